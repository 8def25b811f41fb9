// fuzz_seeds FOLDER: writes the inputs that fuzzing begins with, made of phantoms: FOLDER/dicom and so on.
#include <filesystem>
#include <fstream>

#include "tests/support/dicom_maker.h"
#include "tests/support/nifti_maker.h"
#include "tests/support/zip_maker.h"

using namespace volsmooth::test;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& file, const std::string& bytes) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

void write(const fs::path& file, const ByteVector& bytes) {
  write(file, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

SeriesPhantom small() {
  return {.columns = 5, .rows = 4, .slices = 3, .origin_mm = {-2, -2, -1}};
}

std::string deflated_file(const DicomDataset& dataset) {
  const auto packed = deflated(bytes_of_text(encoded(dataset, transfer_syntax::kDeflated)));
  return dicom_file({}, transfer_syntax::kDeflated) +
         std::string(reinterpret_cast<const char*>(packed.data()), packed.size());
}

void write_dicom(const fs::path& folder) {
  const auto series = series_of(small());
  const auto enhanced = enhanced_of(small());
  for (const auto& [name, syntax] : {std::pair{"implicit", transfer_syntax::kImplicit},
                                     {"explicit", transfer_syntax::kExplicit},
                                     {"big_endian", transfer_syntax::kBigEndian}}) {
    write(folder / (std::string("series_") + name), multipart_of(files_of(series, syntax)));
    write(folder / (std::string("enhanced_") + name), dicom_file(enhanced, syntax));
  }
  std::vector<std::string> deflated_files;
  for (const DicomDataset& slice : series) deflated_files.push_back(deflated_file(slice));
  write(folder / "series_deflated", multipart_of(deflated_files));
  write(folder / "enhanced_deflated", deflated_file(enhanced));
  write(folder / "zip", zip_of(files_of(series)));
  auto uneven = series_of({.columns = 5, .rows = 4, .slices = 5});
  uneven.erase(uneven.begin() + 2);
  write(folder / "uneven", multipart_of(files_of(uneven)));
  auto padded = series;
  for (DicomDataset& slice : padded) {
    slice.ss(0x00280120, -2000);
    slice[0x7fe00010].bytes.replace(0, 4, "\x30\xf8\x30\xf8");
  }
  write(folder / "padded", multipart_of(files_of(padded)));
  SeriesPhantom warm = small();
  warm.intensity = [](const Point& p) { return 500 + 20 * p[0] + 100 * p[2]; };
  write(folder / "pet", multipart_of(files_of(pet_series_of(warm))));
  const auto files = files_of(series_of({.slices = 2}));  // less than 16 x 16 no encoder of JPEG 2000 takes
  for (std::size_t which = 0; which < files.size(); ++which)  // for make_corpus.sh to compress
    write(folder / "slices" / ("slice" + std::to_string(which)), files[which]);
}

void write_nifti(const fs::path& folder) {
  for (const int version : {1, 2}) {
    NiftiFile file;
    file.version = version;
    const ByteVector bytes = bytes_of(file);
    write(folder / "nifti" / ("nifti" + std::to_string(version)), bytes);
    write(folder / "nifti" / ("nifti" + std::to_string(version) + "_gzip"), gzipped(bytes));
    write(folder / "gzip" / ("nifti" + std::to_string(version)), gzipped(bytes));
  }
  write(folder / "gzip" / "zeros", gzipped(ByteVector(100'000)));
}

void write_http(const fs::path& folder) {
  const std::string host = " HTTP/1.1\r\nHost: localhost\r\n";
  const std::string chunked = host + "Transfer-Encoding: chunked\r\n\r\n";
  write(folder / "get", "GET /v1/jobs?limit=2&state=queued" + host + "Accept: */*\r\n\r\n");
  write(folder / "head_1_0", "HEAD /healthz HTTP/1.0\r\nHost: [::1]:8742\r\nConnection: close\r\n\r\n");
  write(folder / "post",
        "POST /v1/volumes" + host + "Content-Length: 5\r\nExpect: 100-continue\r\n\r\nhello");
  write(folder / "chunked", "POST /v1/volumes" + chunked + "2;a=b\r\nhe\r\n3\r\nllo\r\n0\r\nX: y\r\n\r\n");
  write(folder / "delete", "DELETE /v1/jobs/j-aaaaaaaaaaaaaaaa" + host + "If-Match: \"x\"\r\n\r\n");
  write(folder / "both",
        "POST /v1/jobs" + host + "Content-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n");
  write(folder / "escaped",
        "GET /v1/jobs/%2e%2e%2fx?cursor=%41" + host + "Origin: https://localhost\r\n\r\n");
  write(folder / "bare", "GET /healthz HTTP/1.1\nHost: localhost\n\n");
}

void write_orders(const fs::path& folder) {
  write(folder / "shortest", R"({"volume": "v-1"})");
  write(
      folder / "all",
      R"({"volume": "v-aaaaaaaaaaaaaaaa", "method": "mean-curvature-flow", "parameters": {"flow_time_mm2": 1.5,
  "edge": "soft"}, "isovalues": [300, -1e3, 0.1], "mesh_formats": ["stl", "glb"], "mesh_frame": "LPS", "voxel_type":
  "float32", "outputs": ["nifti", "dicom-series"], "destination": "pacs", "priority": -60, "keep_days": 30, "label":
  "gr\u00fc\ud83d\ude00"})");
  write(folder / "source",
        R"({"source": {"dicomweb": "pacs", "study": "1.2.3", "series": "1.2.3.4"}, "isovalues": "auto"})");
  write(folder / "radius", R"({"volume": "v-1", "parameters": {"feature_radius_mm": 2}, "isovalues": []})");
  write(folder / "both", R"({"volume": "v-1", "parameters": {"feature_radius_mm": 2, "flow_time_mm2": 1}})");
  write(folder / "twice", R"({"volume": "v-1", "volume": "v-2"})");
  write(folder / "unknown", R"({"volume": "v-1", "<script>": [1e400, NaN]})");
  write(folder / "deep", R"({"volume": )" + std::string(20, '[') + std::string(20, ']') + "}");
  write(folder / "surrogate", R"({"volume": "v-1", "label": "\ud800"})");
  write(folder / "not_utf8", "{\"volume\": \"v-1\", \"label\": \"\xc0\xaf\"}");
  write(folder / "huge_numbers",
        R"({"volume": "v-1", "keep_days": 18446744073709551615, "priority": 1e308})");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  write_dicom(fs::path(argv[1]) / "dicom");
  write_nifti(argv[1]);
  write_http(fs::path(argv[1]) / "http_head");
  write_orders(fs::path(argv[1]) / "job_order");
}
