#include "tests/support/dicom_maker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <set>

#include "tests/support/zip_maker.h"

namespace volsmooth::test {
namespace {

const std::string kUidRoot = "1.2.826.0.1.3680043.10.1474.";
const std::set<std::string> kLongForm = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                         "SV", "UC", "UN", "UR", "UT", "UV"};

std::size_t word_of(const std::string& vr) {
  static const std::map<std::string, std::size_t> sizes = {{"US", 2}, {"SS", 2}, {"OW", 2}, {"AT", 2},
                                                           {"UL", 4}, {"SL", 4}, {"FL", 4}, {"OF", 4},
                                                           {"FD", 8}, {"OD", 8}};
  const auto found = sizes.find(vr);
  return found == sizes.end() ? 1 : found->second;
}

/// Puts numbers and elements into a byte order.
struct Encoder {
  bool explicit_vr, big_endian;
  std::string out = {};

  template <class T>
  void number(T value) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    if (big_endian) std::ranges::reverse(bytes);
    out += bytes;
  }

  void tag(std::uint32_t tag_number) {
    number(static_cast<std::uint16_t>(tag_number >> 16));
    number(static_cast<std::uint16_t>(tag_number & 0xffff));
  }

  std::string in_order(const DicomValue& value) const {
    const std::size_t word = word_of(value.vr);
    std::string bytes = value.bytes;
    if (!big_endian) return bytes;
    for (std::size_t i = 0; i + word <= bytes.size(); i += word) {
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                   bytes.begin() + static_cast<std::ptrdiff_t>(i + word));
    }
    return bytes;
  }

  void head(std::uint32_t tag_number, const std::string& vr, std::uint32_t length) {
    tag(tag_number);
    if (!explicit_vr) return number(length);
    out += vr;
    if (!kLongForm.contains(vr)) return number(static_cast<std::uint16_t>(length));
    number(std::uint16_t{0});
    number(length);
  }

  void items(const DicomValue& value) {
    for (const DicomDataset& item : value.items) {
      Encoder inner{explicit_vr, big_endian};
      inner.all(item);
      tag(0xfffee000);
      number(value.undefined_length ? 0xffffffffU : static_cast<std::uint32_t>(inner.out.size()));
      out += inner.out;
      if (value.undefined_length) tag(0xfffee00d), number(std::uint32_t{0});
    }
  }

  void all(const DicomDataset& dataset) {
    for (const auto& [tag_number, value] : dataset) {
      if (value.vr != "SQ") {
        const std::string bytes = in_order(value);
        const bool fragments = value.undefined_length;
        head(tag_number, value.vr, fragments ? 0xffffffffU : static_cast<std::uint32_t>(bytes.size()));
        out += bytes;
        continue;
      }
      Encoder inner{explicit_vr, big_endian};
      inner.items(value);
      head(tag_number, "SQ",
           value.undefined_length ? 0xffffffffU : static_cast<std::uint32_t>(inner.out.size()));
      out += inner.out;
      if (value.undefined_length) tag(0xfffee0dd), number(std::uint32_t{0});
    }
  }
};

template <class T>
std::string bytes_of(const T* values, std::size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(T)};
}

std::string decimal(double value) {
  char text[17];
  std::snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

/// What does not depend on the slice.
DicomDataset common(const SeriesPhantom& phantom, const std::string& sop_class) {
  DicomDataset set;
  set.text(0x00080005, "CS", "ISO_IR 100");
  set.text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\AXIAL");
  set.text(0x00080016, "UI", sop_class);
  set.text(0x00080020, "DA", "20200102");
  set.text(0x00080030, "TM", "101112");
  set.text(0x00080050, "SH", "");
  set.text(0x00080060, "CS", "CT");
  set.text(0x00080070, "LO", "volsmooth");
  set.text(0x00080090, "PN", "");
  set.text(0x00100010, "PN", "PLANTED^NAME");
  set.text(0x00100020, "LO", "PLANTED-ID");
  set.text(0x00100030, "DA", "19010203");
  set.text(0x00100040, "CS", "O");
  set.text(0x0020000d, "UI", kUidRoot + "1");
  set.text(0x0020000e, "UI", kUidRoot + "2");
  set.text(0x00200010, "SH", "1");
  set.text(0x00200011, "IS", "1");
  set.text(0x00200052, "UI", kUidRoot + "3");
  set.us(0x00280002, 1);
  set.text(0x00280004, "CS", "MONOCHROME2");
  set.us(0x00280010, static_cast<std::uint16_t>(phantom.rows));
  set.us(0x00280011, static_cast<std::uint16_t>(phantom.columns));
  set.us(0x00280100, 16);
  set.us(0x00280101, 16);
  set.us(0x00280102, 15);
  set.us(0x00280103, 1);
  return set;
}

std::vector<double> orientation_of(const SeriesPhantom& phantom) {
  std::vector<double> six(phantom.row_direction.begin(), phantom.row_direction.end());
  six.insert(six.end(), phantom.column_direction.begin(), phantom.column_direction.end());
  return six;
}

std::vector<double> corner_of(const SeriesPhantom& phantom, std::int64_t slice) {
  const Point corner = position_of(phantom, 0, 0, slice);
  return {corner.begin(), corner.end()};
}

std::vector<std::int16_t> stored_slice(const SeriesPhantom& phantom, std::int64_t slice) {
  std::vector<std::int16_t> stored;
  for (std::int64_t row = 0; row < phantom.rows; ++row) {
    for (std::int64_t column = 0; column < phantom.columns; ++column) {
      const double intensity = phantom.intensity(position_of(phantom, column, row, slice));
      stored.push_back(
          static_cast<std::int16_t>(std::lround((intensity - phantom.intercept) / phantom.slope)));
    }
  }
  return stored;
}

}  // namespace

void DicomDataset::text(std::uint32_t tag, const std::string& vr, std::string value) {
  if (value.size() % 2 != 0) value += vr == "UI" ? '\0' : ' ';
  (*this)[tag] = {vr, std::move(value)};
}

void DicomDataset::us(std::uint32_t tag, std::uint16_t value) {
  (*this)[tag] = {"US", bytes_of(&value, 1)};
}

void DicomDataset::ss(std::uint32_t tag, std::int16_t value) {
  (*this)[tag] = {"SS", bytes_of(&value, 1)};
}

void DicomDataset::words(std::uint32_t tag, const std::vector<std::int16_t>& values) {
  (*this)[tag] = {"OW", bytes_of(values.data(), values.size())};
}

void DicomDataset::numbers(std::uint32_t tag, const std::vector<double>& values) {
  std::string joined;
  for (const double value : values) joined += (joined.empty() ? "" : "\\") + decimal(value);
  text(tag, "DS", joined);
}

void DicomDataset::sequence(std::uint32_t tag, std::vector<DicomDataset> items) {
  (*this)[tag] = {"SQ", "", std::move(items)};
}

std::string encoded(const DicomDataset& dataset, const std::string& transfer_syntax) {
  Encoder encoder{transfer_syntax != transfer_syntax::kImplicit,
                  transfer_syntax == transfer_syntax::kBigEndian};
  encoder.all(dataset);
  return encoder.out;
}

std::string dicom_file(const DicomDataset& dataset, const std::string& transfer_syntax) {
  const auto copied = [&](std::uint32_t tag) {
    const auto found = dataset.find(tag);
    return found == dataset.end() ? DicomValue{"UI", ""} : found->second;
  };
  DicomDataset meta;
  meta[0x00020001] = {"OB", std::string("\0\1", 2)};
  meta[0x00020002] = copied(0x00080016);
  meta[0x00020003] = copied(0x00080018);
  meta.text(0x00020010, "UI", transfer_syntax);
  meta.text(0x00020012, "UI", kUidRoot + "0");
  const auto length = static_cast<std::uint32_t>(encoded(meta, transfer_syntax::kExplicit).size());
  meta[0x00020000] = {"UL", bytes_of(&length, 1)};
  return std::string(128, '\0') + "DICM" + encoded(meta, transfer_syntax::kExplicit) +
         encoded(dataset, transfer_syntax);
}

Point position_of(const SeriesPhantom& phantom, std::int64_t column, std::int64_t row, std::int64_t slice) {
  const Point jitter = phantom.jitter_mm(slice);
  Point position;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    position[axis] = phantom.origin_mm[axis] +
                     static_cast<double>(column) * phantom.column_step_mm * phantom.row_direction[axis] +
                     static_cast<double>(row) * phantom.row_step_mm * phantom.column_direction[axis] +
                     static_cast<double>(slice) * phantom.slice_step_mm[axis] + jitter[axis];
  }
  return position;
}

std::vector<DicomDataset> series_of(const SeriesPhantom& phantom) {
  std::vector<DicomDataset> series;
  for (std::int64_t slice = 0; slice < phantom.slices; ++slice) {
    DicomDataset set = common(phantom, "1.2.840.10008.5.1.4.1.1.2");
    set.text(0x00080018, "UI", kUidRoot + "4." + std::to_string(slice + 1));
    set.text(0x00200013, "IS", std::to_string(phantom.slices - slice));
    set.numbers(0x00200032, corner_of(phantom, slice));
    set.numbers(0x00200037, orientation_of(phantom));
    set.numbers(0x00280030, {phantom.row_step_mm, phantom.column_step_mm});
    set.numbers(0x00281052, {phantom.intercept});
    set.numbers(0x00281053, {phantom.slope});
    set.words(0x7fe00010, stored_slice(phantom, slice));
    series.push_back(std::move(set));
  }
  return series;
}

std::vector<DicomDataset> pet_series_of(const SeriesPhantom& phantom) {
  auto series = series_of(phantom);
  for (std::int64_t slice = 0; slice < phantom.slices; ++slice) {
    double largest = 1;
    for (std::int64_t row = 0; row < phantom.rows; ++row)
      for (std::int64_t column = 0; column < phantom.columns; ++column)
        largest = std::max(largest, phantom.intensity(position_of(phantom, column, row, slice)));
    SeriesPhantom scaled = phantom;
    scaled.slope = largest / std::numeric_limits<std::int16_t>::max();
    scaled.intercept = 0;
    DicomDataset& set = series[static_cast<std::size_t>(slice)];
    set.words(0x7fe00010, stored_slice(scaled, slice));
    set.numbers(0x00281052, {0});
    set.numbers(0x00281053, {scaled.slope});
    set.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.128");
    set.text(0x00080060, "CS", "PT");
    set.text(0x00080008, "CS", "ORIGINAL\\PRIMARY");
    set.text(0x00080021, "DA", "20200102");
    set.text(0x00080031, "TM", "101500");
    set.text(0x00080022, "DA", "20200102");
    set.text(0x00080032, "TM", "101500");
    set.text(0x00180050, "DS", "1");
    set.text(0x00181242, "IS", "300000");
    set.text(0x00280051, "CS", "DECY\\ATTN");
    set.text(0x00541000, "CS", "STATIC\\IMAGE");
    set.text(0x00541001, "CS", "BQML");
    set.text(0x00541002, "CS", "EMISSION");
    set.text(0x00541102, "CS", "START");
    set.text(0x00541300, "DS", "0");
    set.text(0x00541321, "DS", "1");
    set.us(0x00540081, static_cast<std::uint16_t>(phantom.slices));
    set.us(0x00541330, static_cast<std::uint16_t>(slice + 1));
  }
  return series;
}

std::vector<std::string> files_of(const std::vector<DicomDataset>& datasets,
                                  const std::string& transfer_syntax) {
  std::vector<std::string> files;
  for (const DicomDataset& dataset : datasets) files.push_back(dicom_file(dataset, transfer_syntax));
  return files;
}

DicomDataset enhanced_of(const SeriesPhantom& phantom) {
  const auto item = [](std::uint32_t tag, const std::vector<double>& values) {
    DicomDataset set;
    set.numbers(tag, values);
    return set;
  };
  DicomDataset transformation = item(0x00281052, {phantom.intercept});
  transformation.numbers(0x00281053, {phantom.slope});
  transformation.text(0x00281054, "LO", "HU");
  DicomDataset shared;
  shared.sequence(0x00209116, {item(0x00200037, orientation_of(phantom))});
  shared.sequence(0x00289110, {item(0x00280030, {phantom.row_step_mm, phantom.column_step_mm})});
  shared.sequence(0x00289145, {transformation});

  DicomDataset set = common(phantom, "1.2.840.10008.5.1.4.1.1.2.1");
  set.text(0x00080018, "UI", kUidRoot + "5");
  set.text(0x00280008, "IS", std::to_string(phantom.slices));
  set.sequence(0x52009229, {shared});
  std::vector<DicomDataset> frames;
  std::string pixels;
  for (std::int64_t slice = 0; slice < phantom.slices; ++slice) {
    DicomDataset frame;
    frame.sequence(0x00209113, {item(0x00200032, corner_of(phantom, slice))});
    frames.push_back(std::move(frame));
    const auto stored = stored_slice(phantom, slice);
    pixels += bytes_of(stored.data(), stored.size());
  }
  set.sequence(0x52009230, std::move(frames));
  set[0x7fe00010] = {"OW", std::move(pixels)};
  return set;
}

std::string zip_of(const std::vector<std::string>& files) {
  ZipFile zip;
  for (const std::string& file : files)
    zip.entries.emplace_back("series/IM" + std::to_string(zip.entries.size()), bytes_of_text(file));
  const ByteVector bytes = bytes_of(zip);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string multipart_of(const std::vector<std::string>& files, const std::string& boundary) {
  std::string body;
  for (const std::string& file : files)
    body += "--" + boundary + "\r\nContent-Type: application/dicom\r\n\r\n" + file + "\r\n";
  return body + "--" + boundary + "--\r\n";
}

}  // namespace volsmooth::test
