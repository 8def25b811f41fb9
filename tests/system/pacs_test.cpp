// DICOM results in a real archive, Orthanc, beside the series that they were made of.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <optional>

#include "tests/support/dicom_maker.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

using testing::UnorderedElementsAre;

const char* const kOrthanc = "/usr/sbin/Orthanc";
const std::string kDicomWeb = "/usr/share/orthanc/plugins/libOrthancDicomWeb.so";

/// Nobody listens on it now.
int free_port() {
  const int probe = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool bound = bind(probe, reinterpret_cast<const sockaddr*>(&address), size) == 0 &&
                     getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  close(probe);
  if (!bound) throw std::runtime_error("no free port");
  return ntohs(address.sin_port);
}

class Orthanc {
 public:
  Orthanc() : port_(free_port()) {
    const json settings = {{"Name", "test"},
                           {"StorageDirectory", folder_ / "storage"},
                           {"IndexDirectory", folder_ / "storage"},
                           {"HttpPort", port_},
                           {"HttpBindAddresses", {"127.0.0.1"}},
                           {"AuthenticationEnabled", false},
                           {"RemoteAccessAllowed", false},
                           {"DicomServerEnabled", false},
                           {"Plugins", {kDicomWeb}}};
    std::ofstream(folder_ / "settings.json") << settings;
    process_.emplace(std::vector<std::string>{kOrthanc, folder_ / "settings.json"}, folder_ / "log",
                     folder_ / "log");
    const bool up = eventually([&] {
      try {
        return HttpConnection(port_).exchange("GET", "/system", {}, {}).status == 200;
      } catch (const std::runtime_error&) {
        return false;
      }
    });
    if (!up) throw std::runtime_error("Orthanc did not start:\n" + content_of(folder_ / "log"));
  }

  /// A DICOM file, or a zip of them.
  void store(const std::string& file) const {
    expect_status(HttpConnection(port_).exchange("POST", "/instances", file, {}), 200);
  }

  json query(const std::string& target) const {
    const HeaderFields headers{{"Accept", "application/dicom+json"}};
    return expect_status(HttpConnection(port_).exchange("GET", "/dicom-web" + target, {}, headers), 200)
        .document();
  }

 private:
  TemporaryDirectory folder_;
  int port_;
  std::optional<ChildProcess> process_;
};

std::string first(const json& attributes, const std::string& tag) {
  const json& value = attributes.at(tag).at("Value").at(0);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

SeriesPhantom phantom() {
  SeriesPhantom ball;
  ball.columns = ball.rows = 24;
  ball.slices = 12;
  ball.origin_mm = {-11.5, -13.5, -11};
  ball.slice_step_mm = {0, 0.3, 2};  // a tilted gantry
  ball.intensity = [](const Point& p) { return 100 - 20 * (std::hypot(p[0], p[1], p[2]) - 8); };
  return ball;
}

TEST(Pacs, FindsEveryDicomResultInTheStudyOfItsSource) {
  if (!std::filesystem::exists(kOrthanc) || !std::filesystem::exists(kDicomWeb)) GTEST_SKIP() << "no Orthanc";
  const Orthanc archive;
  const auto datasets = series_of(phantom());
  const auto files = files_of(datasets);
  for (const std::string& file : files) archive.store(file);

  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient client(daemon);
  const json volume = client.upload(multipart_of(files));
  const json job =
      client.run({{"volume", volume.at("id")},
                  {"isovalues", {100}},
                  {"mesh_formats", json::array()},
                  {"outputs", {"dicom-series", "dicom-stl", "dicom-obj", "dicom-surface-segmentation"}}});
  for (const json& result : job.at("results"))
    if (result.at("kind") == "series" || result.at("kind") == "dicom")
      archive.store(client.fetch(job.at("id"), result.at("name")));

  const json studies = archive.query("/studies");
  ASSERT_EQ(studies.size(), 1u);
  const std::string study = "/studies/" + first(studies[0], "0020000D") + "/series";
  std::vector<std::string> modalities;
  std::string derived;
  for (const json& series : archive.query(study + "?includefield=00080060,0008103E")) {
    modalities.push_back(first(series, "00080060"));
    const bool is_ours = series.contains("0008103E") && first(series, "0008103E") == "mean-curvature-flow";
    if (modalities.back() == "CT" && is_ours) derived = first(series, "0020000E");
  }
  EXPECT_THAT(modalities, UnorderedElementsAre("CT", "CT", "M3D", "SEG"));

  const json instances = archive.query(study + "/" + derived + "/metadata");
  ASSERT_EQ(instances.size(), datasets.size());
  for (const json& instance : instances) {
    const int slice = std::stoi(first(instance, "00200013")) - 1;
    const Point expected = position_of(phantom(), 0, 0, slice);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const json& value = instance.at("00200032").at("Value").at(axis);
      EXPECT_NEAR(value.is_number() ? value.get<double>() : std::stod(value.get<std::string>()),
                  expected[axis], 0.01);
    }
    EXPECT_EQ(first(instance, "00200052"), first(instances[0], "00200052"));
  }
}

}  // namespace
}  // namespace volsmooth::test
