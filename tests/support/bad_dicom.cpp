#include "tests/support/bad_dicom.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "tests/support/zip_maker.h"

namespace volsmooth::test {
namespace {

using Datasets = std::vector<DicomDataset>;

const SeriesPhantom kSmall{.columns = 6, .rows = 5, .slices = 4};

template <class T>
std::string little(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

std::string tag_bytes(std::uint32_t tag) {
  return little(static_cast<std::uint16_t>(tag >> 16)) + little(static_cast<std::uint16_t>(tag & 0xffff));
}

/// An element of explicit little endian whose length is what is said.
std::string raw_element(std::uint32_t tag, const std::string& vr, std::uint32_t length,
                        const std::string& value = {}) {
  return tag_bytes(tag) + vr + std::string(2, '\0') + little(length) + value;
}

std::string upload_of(const Datasets& series) {
  return multipart_of(files_of(series));
}

/// A series whose second slice is changed.
std::function<std::string()> slice_with(std::function<void(DicomDataset&)> change) {
  return [change = std::move(change)] {
    Datasets series = series_of(kSmall);
    change(series[1]);
    return upload_of(series);
  };
}

/// A series all of whose slices are changed.
std::function<std::string()> slices_with(std::function<void(DicomDataset&)> change) {
  return [change = std::move(change)] {
    Datasets series = series_of(kSmall);
    std::ranges::for_each(series, change);
    return upload_of(series);
  };
}

std::function<std::string()> phantom_with(std::function<void(SeriesPhantom&)> change) {
  return [change = std::move(change)] {
    SeriesPhantom phantom = kSmall;
    change(phantom);
    return upload_of(series_of(phantom));
  };
}

/// A series whose second file's bytes are changed.
std::function<std::string()> file_with(std::function<std::string(std::string)> change) {
  return [change = std::move(change)] {
    std::vector<std::string> files = files_of(series_of(kSmall));
    files[1] = change(files[1]);
    return multipart_of(files);
  };
}

std::function<std::string()> tail(const std::string& bytes) {
  return file_with([bytes](const std::string& file) { return file + bytes; });
}

std::function<std::string()> without(std::uint32_t tag) {
  return slice_with([tag](DicomDataset& slice) { slice.erase(tag); });
}

std::function<std::string()> slice_us(std::uint32_t tag, std::uint16_t value) {
  return slice_with([=](DicomDataset& slice) { slice.us(tag, value); });
}

std::function<std::string()> slice_text(std::uint32_t tag, const std::string& vr, const std::string& value) {
  return slice_with([=](DicomDataset& slice) { slice.text(tag, vr, value); });
}

std::function<std::string()> all_text(std::uint32_t tag, const std::string& vr, const std::string& value) {
  return slices_with([=](DicomDataset& slice) { slice.text(tag, vr, value); });
}

std::string nested(int levels) {
  std::string open;
  for (int level = 0; level < levels; ++level)
    open += raw_element(0x00081140, "SQ", 0xffffffff) + tag_bytes(0xfffee000) + little(0xffffffffU);
  return open;
}

/// One slice whose pixels are one fragment of a transfer syntax.
std::function<std::string()> encapsulated(const std::string& syntax, const std::string& stream) {
  return [=] {
    Datasets series = series_of(kSmall);
    std::vector<std::string> files;
    for (DicomDataset& slice : series) {
      slice.erase(0x7fe00010);
      std::string fragments = tag_bytes(0xfffee000) + little(0U) + tag_bytes(0xfffee000) +
                              little(static_cast<std::uint32_t>(stream.size())) + stream +
                              tag_bytes(0xfffee0dd) + little(0U);
      files.push_back(dicom_file(slice, syntax) + raw_element(0x7fe00010, "OB", 0xffffffff, fragments));
    }
    return multipart_of(files);
  };
}

std::string bad_run_lengths() {
  std::string header = little(2U) + little(0xfffffff0U) + little(0xfffffff8U);
  header.resize(128);
  return header;
}

/// Runs of 128 zeros where a segment has 30 cells.
std::string run_over_the_end() {
  std::string frame = little(2U) + little(64U) + little(66U);
  frame.resize(64);
  return frame + std::string("\x81\0\x81\0", 4);
}

std::string jpeg_claiming(std::uint16_t edge) {
  const std::string size{static_cast<char>(edge >> 8), static_cast<char>(edge & 0xff)};
  return std::string("\xff\xd8\xff\xc3\x00\x0b\x10", 7) + size + size +
         std::string("\x01\x01\x11\x00\xff\xd9", 6) + '\0';
}

std::string enhanced_file(const std::function<void(DicomDataset&)>& change) {
  DicomDataset set = enhanced_of(kSmall);
  change(set);
  return dicom_file(set);
}

/// Two series, told apart by their UID, in one upload.
std::string two_series(std::uint32_t differing, const std::string& vr, const std::string& value) {
  Datasets series = series_of(kSmall), other = series_of(kSmall);
  int instance = 0;
  for (DicomDataset& slice : other) {
    slice.text(0x0020000e, "UI", "1.2.3.77");
    slice.text(0x00080018, "UI", "1.2.3.77." + std::to_string(++instance));
    slice.text(differing, vr, value);
  }
  series.insert(series.end(), other.begin(), other.end());
  return upload_of(series);
}

std::vector<DicomUpload> structure_rows() {
  const std::string mz = "MZ", elf =
                                   "\x7f"
                                   "ELF";
  const auto preamble = [](const std::string& magic) {
    return file_with([magic](std::string file) { return file.replace(0, magic.size(), magic); });
  };
  return {
      {"D1NoMagic",
       [] {
         return multipart_of({"no DICOM", std::string(500, 'x')});
       },
       422, "dicom-no-images"},
      {"D1WrongMagic",
       [] {
         auto files = files_of(series_of(kSmall));
         for (auto& file : files) file.replace(128, 4, "DICX");
         return multipart_of(files);
       },
       422, "dicom-no-images"},
      {"D1Extras",
       [] {
         auto files = files_of(series_of(kSmall));
         files.insert(files.begin(), "read me");
         return multipart_of(files);
       },
       201, "", "", "ignored-files: 1 "},
      {"D2MetaHeaderCut", file_with([](const std::string& file) { return file.substr(0, 200); }), 422,
       "dicom-truncated"},
      {"D2PreambleOnly", [] { return std::string(128, '\0') + "DICM"; }, 422, "dicom-missing-attribute"},
      {"D3HugePrivateLength", tail(raw_element(0x00091010, "OB", 0xf0000000, "xx")), 422, "dicom-bad-length"},
      {"ItemLongerThanItsSequence",
       tail(raw_element(0x00081140, "SQ", 8, tag_bytes(0xfffee000) + little(100'000U))), 422,
       "dicom-bad-length"},
      {"D4HugePixelDataLength",
       [] {
         Datasets series = series_of(kSmall);
         series[1].erase(0x7fe00010);
         auto files = files_of(series);
         files[1] += raw_element(0x7fe00010, "OW", 0xfffffff0, "xx");
         return multipart_of(files);
       },
       422, "dicom-bad-length"},
      {"D5PixelsShort",
       slice_with([](DicomDataset& slice) { slice.words(0x7fe00010, std::vector<std::int16_t>(29)); }), 422,
       "dicom-pixel-length"},
      {"D5PixelsLong",
       slice_with([](DicomDataset& slice) { slice.words(0x7fe00010, std::vector<std::int16_t>(31)); }), 422,
       "dicom-pixel-length"},
      {"D5FileCut", file_with([](const std::string& file) { return file.substr(0, file.size() - 4); }), 422,
       "dicom-pixel-length"},
      {"D6NoPixelData", without(0x7fe00010), 422, "dicom-no-pixels"},
      {"D6EmptyPixelData", slice_with([](DicomDataset& slice) { slice.words(0x7fe00010, {}); }), 422,
       "dicom-no-pixels"},
      {"D7NoRows", without(0x00280010), 422, "dicom-missing-attribute"},
      {"D7ZeroColumns", slice_us(0x00280011, 0), 422, "dicom-missing-attribute"},
      {"D8RowsAsUl", slice_with([](DicomDataset& slice) {
         slice[0x00280010] = {"UL", little(5U)};
       }),
       422, "dicom-bad-vr"},
      {"D8UnknownVr", tail(raw_element(0x00291010, "XX", 2, "xx")), 422, "dicom-bad-vr"},
      {"D9Huge",
       [] {
         return enhanced_file([](DicomDataset& set) {
           set.us(0x00280010, 65535);
           set.us(0x00280011, 65535);
           set.text(0x00280008, "IS", "1000000");
         });
       },
       422, "volume-too-large"},
      {"D13NestedTwentyThousand", tail(nested(20'000)), 422, "dicom-nesting"},
      {"D14NoDelimiter", tail(nested(1)), 422, "dicom-truncated"},
      {"D15UnknownTransferSyntax", [] { return multipart_of(files_of(series_of(kSmall), "1.2.3.4")); }, 415,
       "dicom-transfer-syntax"},
      {"D15Implicit", [] { return multipart_of(files_of(series_of(kSmall), transfer_syntax::kImplicit)); },
       201},
      {"D15BigEndian", [] { return multipart_of(files_of(series_of(kSmall), transfer_syntax::kBigEndian)); },
       201},
      {"D16RunLengths", encapsulated(transfer_syntax::kRle, bad_run_lengths()), 422, "dicom-decode-failed"},
      {"D16RunOverTheEnd", encapsulated(transfer_syntax::kRle, run_over_the_end()), 422,
       "dicom-decode-failed"},
      {"D16JpegClaim", encapsulated(transfer_syntax::kJpegLossless, jpeg_claiming(65535)), 422,
       "dicom-decode-failed"},
      {"D16JpegWithoutScan", encapsulated(transfer_syntax::kJpegLossless, jpeg_claiming(6)), 422,
       "dicom-decode-failed"},
      {"D16Jpeg2000Noise", encapsulated(transfer_syntax::kJpeg2000, std::string(600, '\x5a')), 422,
       "dicom-decode-failed"},
      {"D18WindowsProgram", preamble(mz), 422, "dicom-suspicious-preamble"},
      {"D18LinuxProgram", preamble(elf), 422, "dicom-suspicious-preamble"},
      {"AttributeTwice",
       tail(tag_bytes(0x00280010) + "US" + little(std::uint16_t{2}) + little(std::uint16_t{5})), 422,
       "dicom-bad-attribute"},
      {"PartWithoutEnd",
       [] {
         const std::string body = good_dicom_upload();
         return body.substr(0, body.size() - 30);
       },
       422, "multipart-corrupt"},
  };
}

std::vector<DicomUpload> pixel_rows() {
  const auto bits = [](std::uint16_t allocated) {
    return slices_with([=](DicomDataset& slice) { slice.us(0x00280100, allocated); });
  };
  return {
      {"D10NoBits", bits(0), 422, "dicom-bad-pixel-format"},
      {"D10TwelveBits", bits(12), 422, "dicom-bad-pixel-format"},
      {"D10TwoThousandBits", bits(2048), 422, "dicom-bad-pixel-format"},
      {"D10HighBit", slice_us(0x00280102, 14), 422, "dicom-bad-pixel-format"},
      {"D11Palette", all_text(0x00280004, "CS", "PALETTE COLOR"), 422, "dicom-unsupported-photometric"},
      {"D12ThreeSamples", slice_us(0x00280002, 3), 422, "dicom-unsupported-photometric"},
      {"D12Ybr", slice_text(0x00280004, "CS", "YBR_FULL_422"), 422, "dicom-unsupported-photometric"},
      {"D21SlopeNan", slice_text(0x00281053, "DS", "NaN"), 422, "dicom-bad-rescale"},
      {"D21SlopeZero", slice_text(0x00281053, "DS", "0"), 422, "dicom-bad-rescale"},
      {"D21SlopeText", slice_text(0x00281053, "DS", "abc"), 422, "dicom-bad-rescale"},
      {"D21SlopeHuge", slice_text(0x00281053, "DS", "1e38"), 422, "dicom-bad-rescale"},
      {"D21SlopeBySlice", slice_text(0x00281053, "DS", "2"), 201, "", "", "rescaled-by-slice"},
      {"D29OverlayInPixels", slice_with([](DicomDataset& slice) { slice.us(0x60000100, 16); }), 422,
       "dicom-unsupported-sop-class"},
      {"BitsBeyondStored", slices_with([](DicomDataset& slice) {
         slice.us(0x00280101, 8);
         slice.us(0x00280102, 7);
         slice.us(0x00280103, 0);
       }),
       422, "dicom-bad-pixel-format"},
  };
}

std::vector<DicomUpload> geometry_rows() {
  const auto uneven = [](double by) {
    return phantom_with([by](SeriesPhantom& phantom) {
      phantom.slices = 12;
      phantom.jitter_mm = [by](std::int64_t slice) { return Point{0, 0, slice == 5 ? by : 0}; };
    });
  };
  const auto gap = [] {
    Datasets series = series_of(kSmall);
    series.erase(series.begin() + 1);
    return upload_of(series);
  };
  return {
      {"D19SpacingZero", all_text(0x00280030, "DS", "0\\0"), 422, "dicom-bad-spacing"},
      {"D19SpacingNegative", all_text(0x00280030, "DS", "-1\\-1"), 422, "dicom-bad-spacing"},
      {"D19SpacingNan", all_text(0x00280030, "DS", "nan\\nan"), 422, "dicom-bad-spacing"},
      {"D19SpacingText", all_text(0x00280030, "DS", "a\\b"), 422, "dicom-bad-spacing"},
      {"D19SpacingMany", slice_with([](DicomDataset& slice) {
         std::string many = "1";
         for (int i = 0; i < 30'000; ++i) many += "\\1";
         slice.text(0x00280030, "DS", many);
       }),
       422, "dicom-bad-spacing"},
      {"D19NoSpacing", without(0x00280030), 422, "dicom-bad-spacing"},
      {"D20OrientationZero", all_text(0x00200037, "DS", "0\\0\\0\\0\\0\\0"), 422, "dicom-bad-orientation"},
      {"D20OrientationOblique", all_text(0x00200037, "DS", "1\\0\\0\\0.7071\\0.7071\\0"), 422,
       "dicom-bad-orientation"},
      {"D20NoOrientation", without(0x00200037), 422, "dicom-bad-orientation"},
      {"D20NoPosition", without(0x00200032), 422, "dicom-bad-orientation"},
      {"D24Size",
       [] {
         Datasets series = series_of(kSmall);
         SeriesPhantom other = kSmall;
         other.rows = 6;
         series[1] = series_of(other)[1];
         return upload_of(series);
       },
       422, "dicom-inconsistent-series"},
      {"D24Type", slice_us(0x00280103, 0), 422, "dicom-inconsistent-series"},
      {"D24Spacing", slice_text(0x00280030, "DS", "1.01\\1"), 422, "dicom-inconsistent-series"},
      {"D24Orientation", slice_text(0x00200037, "DS", "0\\1\\0\\1\\0\\0"), 422, "dicom-inconsistent-series"},
      {"D25SamePosition", slice_text(0x00200032, "DS", "-8\\-8\\-4"), 422, "dicom-duplicate-slice"},
      {"D25SameInstance",
       [] {
         Datasets series = series_of(kSmall);
         series[1][0x00080018] = series[0][0x00080018];
         return upload_of(series);
       },
       422, "dicom-duplicate-slice"},
      {"D26Missing", gap, 422, "dicom-nonuniform-spacing"},
      {"D26MissingResampled", gap, 201, "", "resample=uniform", "resampled"},
      {"D26Uneven", uneven(0.1), 422, "dicom-nonuniform-spacing"},
      {"D26AlmostEven", uneven(0.01), 201, "", "", "uneven-slices"},
      {"D27Tilt", phantom_with([](SeriesPhantom& phantom) {
         phantom.slice_step_mm = {0, 0.4, 1};
       }),
       201, "", "", "gantry-tilt"},
      {"D28OneSlice", [] { return files_of(series_of(kSmall)).front(); }, 422, "dicom-too-few-slices"},
      {"D30Shuffled",
       [] {
         Datasets series = series_of(kSmall);
         std::swap(series[0], series[2]);
         return upload_of(series);
       },
       201},
      {"D31NegativeFrames",
       [] { return enhanced_file([](DicomDataset& set) { set.text(0x00280008, "IS", "-5"); }); }, 422,
       "dicom-bad-attribute"},
      {"D31TextFrames",
       [] { return enhanced_file([](DicomDataset& set) { set.text(0x00280008, "IS", "abc"); }); }, 422,
       "dicom-bad-attribute"},
  };
}

std::vector<DicomUpload> object_rows() {
  const auto of_class = [](const std::string& uid) { return all_text(0x00080016, "UI", uid); };
  return {
      {"D22TwoSeries", [] { return two_series(0x00200011, "IS", "2"); }, 422, "dicom-mixed-series"},
      {"D22OnePicked", [] { return two_series(0x00200011, "IS", "2"); }, 201, "", "series=1.2.3.77",
       "ignored-files: 4 "},
      {"D22UnknownPicked", [] { return two_series(0x00200011, "IS", "2"); }, 422, "dicom-unknown-series",
       "series=1.2.3.4"},
      {"D23TwoPatients", [] { return two_series(0x00100020, "LO", "another"); }, 422, "dicom-mixed-patient"},
      {"D23TwoStudies", [] { return two_series(0x0020000d, "UI", "1.2.3.88"); }, 422, "dicom-mixed-patient"},
      {"D23PatientInSeries", slice_text(0x00100010, "PN", "ANOTHER^NAME"), 422, "dicom-mixed-patient"},
      {"D29Localizer", slice_text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\LOCALIZER"), 422,
       "dicom-unsupported-sop-class"},
      {"D29StructuredReport", of_class("1.2.840.10008.5.1.4.1.1.88.11"), 422, "dicom-unsupported-sop-class"},
      {"D29Pdf", of_class("1.2.840.10008.5.1.4.1.1.104.1"), 422, "dicom-unsupported-sop-class"},
      {"D29Enhanced", [] { return enhanced_file([](DicomDataset&) {}); }, 201},
      {"D29EnhancedWithoutGeometry",
       [] { return enhanced_file([](DicomDataset& set) { set.erase(0x52009229); }); }, 422,
       "dicom-missing-attribute"},
      {"D29EnhancedWithoutFrames",
       [] { return enhanced_file([](DicomDataset& set) { set.erase(0x52009230); }); }, 422,
       "dicom-missing-attribute"},
      {"D32Script", all_text(0x00100010, "PN", "<script>alert(1)</script>"), 201},
      {"D32Charsets", all_text(0x00080005, "CS", "\\ISO 2022 IR 87\\ISO 2022 IR 149\\nonsense"), 201},
  };
}

}  // namespace

std::vector<DicomUpload> dicom_uploads() {
  std::vector<DicomUpload> all;
  for (const auto& rows : {structure_rows(), pixel_rows(), geometry_rows(), object_rows()})
    all.insert(all.end(), rows.begin(), rows.end());
  return all;
}

std::string good_dicom_upload() {
  return upload_of(series_of(kSmall));
}

/// A raw deflate block of a megabyte of zeros that refers to nothing before it and is not the last; by zlib,
/// which packs them a thousand to one.
std::string deflated_zeros() {
  std::string zeros(std::size_t{1} << 20, '\0'), packed(4096, '\0');
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(zeros.data());
  stream.avail_in = static_cast<uInt>(zeros.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const bool done = deflate(&stream, Z_FULL_FLUSH) == Z_OK && stream.avail_in == 0 && stream.avail_out > 0;
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (!done) throw std::runtime_error("deflate failed");
  return packed;
}

std::string deflated_bomb() {
  constexpr std::uint32_t kMegabytes = 300;
  const std::string element = raw_element(0x00091010, "OB", kMegabytes << 20);
  const auto length = static_cast<std::uint16_t>(element.size());
  std::string file = dicom_file({}, transfer_syntax::kDeflated);
  file += '\0' + little(length) + little(static_cast<std::uint16_t>(~length)) + element;  // a stored block
  const std::string zeros = deflated_zeros();
  for (std::uint32_t i = 0; i < kMegabytes; ++i) file += zeros;
  return file + std::string("\x03\0", 2);  // an empty last block
}

}  // namespace volsmooth::test
