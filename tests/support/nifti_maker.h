#pragma once

#include <isa-l/igzip_lib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace volsmooth::test {

using ByteVector = std::vector<std::byte>;

/// A NIfTI file to be: a small good one until a test changes a field. Fields hold what is written, good or
/// bad.
struct NiftiFile {
  int version = 1;
  std::endian byte_order = std::endian::little;
  std::vector<std::int64_t> size{4, 5, 6};
  std::optional<std::int64_t> dimensions = {};  ///< dim[0], if not the number of sizes
  int datatype = 4;                             ///< int16
  std::optional<int> bitpix = {};
  std::array<double, 8> pixdim{1, 1, 1, 1, 0, 0, 0, 0};
  std::optional<double> vox_offset =
      {};  ///< written into the header; the voxels lie behind `extensions` anyway
  double slope = 1, inter = 0;
  int units = 2;  ///< mm
  int intent_code = 0;
  int qform_code = 0, sform_code = 1;
  std::array<double, 3> quatern = {}, qoffset = {};
  std::array<double, 12> srow{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  std::string descrip = {}, aux_file = {};
  ByteVector extensions = {};                    ///< all that lies between the extension flags and the voxels
  std::optional<bool> extended = {};             ///< the extension flag, if not whether there are any
  std::vector<double> voxels = ramp(4 * 5 * 6);  ///< as stored, before slope and inter

  static std::vector<double> ramp(std::size_t count) {
    std::vector<double> values(count);
    std::iota(values.begin(), values.end(), 0.0);
    return values;
  }
};

/// Bytes in a byte order, one behind the other or over earlier ones.
class ByteWriter {
 public:
  explicit ByteWriter(std::endian order) : order_(order) {}

  template <class T>
  void append(T value) {
    auto raw = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
    if (order_ != std::endian::native) std::ranges::reverse(raw);
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }

  template <class T, class Numbers>
  void append_all(const Numbers& numbers) {
    for (const auto number : numbers) append(static_cast<T>(number));
  }

  void append_text(std::string_view text, std::size_t width) {
    const auto begin = bytes_.size();
    bytes_.resize(begin + width);
    std::memcpy(bytes_.data() + begin, text.data(), std::min(text.size(), width));
  }

  void append_zeros(std::size_t count) { bytes_.resize(bytes_.size() + count); }
  void append_bytes(const ByteVector& more) { bytes_.insert(bytes_.end(), more.begin(), more.end()); }
  std::size_t size() const { return bytes_.size(); }
  ByteVector take() { return std::move(bytes_); }

 private:
  std::endian order_;
  ByteVector bytes_;
};

struct StoredType {
  int bits;
  std::function<void(ByteWriter&, double)> append;
};

inline const std::map<int, StoredType>& stored_types() {
  const auto type = []<class T>(T) {
    return StoredType{8 * sizeof(T),
                      [](ByteWriter& out, double value) { out.append(static_cast<T>(value)); }};
  };
  static const std::map<int, StoredType> types{{2, type(std::uint8_t{})},    {256, type(std::int8_t{})},
                                               {4, type(std::int16_t{})},    {512, type(std::uint16_t{})},
                                               {8, type(std::int32_t{})},    {768, type(std::uint32_t{})},
                                               {1024, type(std::int64_t{})}, {1280, type(std::uint64_t{})},
                                               {16, type(float{})},          {64, type(double{})}};
  return types;
}

inline std::array<std::int64_t, 8> dim_of(const NiftiFile& file) {
  std::array<std::int64_t, 8> dim{0, 1, 1, 1, 1, 1, 1, 1};
  dim[0] = file.dimensions.value_or(static_cast<std::int64_t>(file.size.size()));
  std::ranges::copy(file.size, dim.begin() + 1);
  return dim;
}

inline int bitpix_of(const NiftiFile& file) {
  const auto type = stored_types().find(file.datatype);
  return file.bitpix.value_or(type == stored_types().end() ? 16 : type->second.bits);
}

/// nifti1.h: offsets 0 to 348.
inline void append_header1(ByteWriter& out, const NiftiFile& file, double vox_offset) {
  out.append(std::int32_t{348});
  out.append_text("", 28);  // data_type, db_name
  out.append_zeros(8);      // extents, session_error, regular, dim_info
  out.append_all<std::int16_t>(dim_of(file));
  out.append_zeros(12);  // intent parameters
  out.append_all<std::int16_t>(std::array{file.intent_code, file.datatype, bitpix_of(file), 0});
  out.append_all<float>(file.pixdim);
  out.append_all<float>(std::array{vox_offset, file.slope, file.inter});
  out.append(std::int16_t{0});  // slice_end
  out.append_all<char>(std::array{0, file.units});
  out.append_zeros(24);  // cal_max to glmin
  out.append_text(file.descrip, 80);
  out.append_text(file.aux_file, 24);
  out.append_all<std::int16_t>(std::array{file.qform_code, file.sform_code});
  out.append_all<float>(file.quatern);
  out.append_all<float>(file.qoffset);
  out.append_all<float>(file.srow);
  out.append_zeros(16);  // intent_name
  out.append_text("n+1", 4);
}

/// nifti2.h: offsets 0 to 540.
inline void append_header2(ByteWriter& out, const NiftiFile& file, double vox_offset) {
  out.append(std::int32_t{540});
  out.append_text(std::string_view("n+2\0\r\n\x1a\n", 8), 8);
  out.append_all<std::int16_t>(std::array{file.datatype, bitpix_of(file)});
  out.append_all<std::int64_t>(dim_of(file));
  out.append_zeros(24);  // intent parameters
  out.append_all<double>(file.pixdim);
  out.append(static_cast<std::int64_t>(vox_offset));
  out.append_all<double>(std::array{file.slope, file.inter});
  out.append_zeros(48);  // cal_max to slice_end
  out.append_text(file.descrip, 80);
  out.append_text(file.aux_file, 24);
  out.append_all<std::int32_t>(std::array{file.qform_code, file.sform_code});
  out.append_all<double>(file.quatern);
  out.append_all<double>(file.qoffset);
  out.append_all<double>(file.srow);
  out.append_all<std::int32_t>(std::array{0, file.units, file.intent_code});
  out.append_zeros(32);  // intent_name, dim_info, unused_str
}

inline ByteVector bytes_of(const NiftiFile& file) {
  ByteWriter out(file.byte_order);
  const std::size_t least = file.version == 1 ? 352 : 544;
  const double vox_offset = file.vox_offset.value_or(static_cast<double>(least + file.extensions.size()));
  if (file.version == 1) append_header1(out, file, vox_offset);
  if (file.version == 2) append_header2(out, file, vox_offset);
  out.append_all<char>(std::array{file.extended.value_or(!file.extensions.empty()), false, false, false});
  out.append_bytes(file.extensions);
  const auto type = stored_types().find(file.datatype);
  if (type != stored_types().end()) {
    for (const double voxel : file.voxels) type->second.append(out, voxel);
  }
  return out.take();
}

/// One gzip member of `bytes`.
inline ByteVector gzipped(const ByteVector& bytes) {
  ByteVector out(bytes.size() + bytes.size() / 100 + 1024);
  std::vector<std::uint8_t> level_buffer(ISAL_DEF_LVL3_DEFAULT);
  isal_zstream stream;
  isal_deflate_stateless_init(&stream);
  stream.hist_bits = 0;  // which it leaves as it was
  stream.gzip_flag = IGZIP_GZIP;
  stream.level = 3;
  stream.level_buf = level_buffer.data();
  stream.level_buf_size = static_cast<std::uint32_t>(level_buffer.size());
  stream.end_of_stream = 1;
  stream.next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(bytes.data()));
  stream.avail_in = static_cast<std::uint32_t>(bytes.size());
  stream.next_out = reinterpret_cast<std::uint8_t*>(out.data());
  stream.avail_out = static_cast<std::uint32_t>(out.size());
  if (isal_deflate_stateless(&stream) != COMP_OK) throw std::runtime_error("gzip failed");
  out.resize(stream.total_out);
  return out;
}

}  // namespace volsmooth::test
