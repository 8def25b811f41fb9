#pragma once

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace volsmooth::test {

using Bytes = std::string;

/// Byte offsets of NIfTI-1 header fields (nifti1.h).
namespace nifti1 {
enum Offset : std::size_t {
  kSizeofHdr = 0,
  kDim = 40,
  kIntentCode = 68,
  kDatatype = 70,
  kBitpix = 72,
  kPixdim = 76,
  kVoxOffset = 108,
  kSclSlope = 112,
  kSclInter = 116,
  kXyztUnits = 123,
  kDescrip = 148,
  kAuxFile = 228,
  kQformCode = 252,
  kSformCode = 254,
  kQuaternB = 256,
  kQoffset = 268,
  kSrow = 280,
  kMagic = 344,
  kExtender = 348,
  kData = 352,
};
}

/// And of NIfTI-2 (nifti2.h).
namespace nifti2 {
enum Offset : std::size_t {
  kDatatype = 12,
  kBitpix = 14,
  kDim = 16,
  kPixdim = 104,
  kVoxOffset = 168,
  kSclSlope = 176,
  kData = 544
};
}

/// A value that is written over the bytes at an offset.
struct Edit {
  std::size_t offset;
  Bytes bytes;
};

template <class T>
Bytes bytes_of(const T& value) {
  Bytes bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

template <class T>
Edit put(std::size_t offset, T value) {
  return {offset, bytes_of(value)};
}

/// Numbers one after the other, such as a row of a matrix.
template <class T>
Edit put_all(std::size_t offset, std::initializer_list<T> values) {
  Bytes bytes;
  for (const T& value : values) bytes += bytes_of(value);
  return {offset, bytes};
}

inline Bytes edited(Bytes file, const std::vector<Edit>& edits) {
  for (const Edit& edit : edits) file.replace(edit.offset, edit.bytes.size(), edit.bytes);
  return file;
}

template <class T>
T read_at(const Bytes& file, std::size_t offset) {
  T value;
  if (file.size() < offset + sizeof value) throw std::runtime_error("the file ends before the value");
  std::memcpy(&value, file.data() + offset, sizeof value);
  return value;
}

template <class T>
inline constexpr std::int16_t kDatatypeCode = 0;
template <>
inline constexpr std::int16_t kDatatypeCode<std::uint8_t> = 2;
template <>
inline constexpr std::int16_t kDatatypeCode<std::int16_t> = 4;
template <>
inline constexpr std::int16_t kDatatypeCode<float> = 16;

/// A good little-endian NIfTI-1 file: mm, scaling 1 and 0, a scanner sform along the axes.
template <class T>
Bytes make_nifti1(const std::array<int, 3>& size, const std::array<float, 3>& spacing_mm,
                  std::span<const T> voxels) {
  using namespace nifti1;
  const auto dim = [&](std::size_t axis) { return static_cast<std::int16_t>(size[axis]); };
  const auto bits = static_cast<std::int16_t>(8 * sizeof(T));
  const auto [dx, dy, dz] = spacing_mm;
  Bytes file = edited(
      Bytes(kData, '\0'),
      {put(kSizeofHdr, std::int32_t{348}),
       put_all<std::int16_t>(kDim, {3, dim(0), dim(1), dim(2), 1, 1, 1, 1}), put(kDatatype, kDatatypeCode<T>),
       put(kBitpix, bits), put_all(kPixdim, {1.F, dx, dy, dz}), put(kVoxOffset, float{kData}),
       put(kSclSlope, 1.F), put(kXyztUnits, char{2}), put(kSformCode, std::int16_t{1}),
       put_all(kSrow, {dx, 0.F, 0.F, 0.F, 0.F, dy, 0.F, 0.F, 0.F, 0.F, dz, 0.F}),
       Edit{kMagic, Bytes("n+1\0", 4)}});
  return file.append(reinterpret_cast<const char*>(voxels.data()), voxels.size_bytes());
}

/// Compressed or uncompressed by zlib, in the gzip format.
inline Bytes gzip(std::string_view bytes, int level = 1) {
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::runtime_error("deflateInit2 failed");
  Bytes out(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int ended = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (ended != Z_STREAM_END) throw std::runtime_error("deflate failed");
  return out;
}

inline Bytes gunzip(std::string_view compressed) {
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 16) != Z_OK) throw std::runtime_error("inflateInit2 failed");
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(compressed.data()));
  stream.avail_in = static_cast<uInt>(compressed.size());
  Bytes out;
  std::vector<char> block(1 << 20);
  int result = Z_OK;
  while (result == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(block.data());
    stream.avail_out = static_cast<uInt>(block.size());
    result = inflate(&stream, Z_NO_FLUSH);
    out.append(block.data(), block.size() - stream.avail_out);
    if (result == Z_STREAM_END && stream.avail_in > 0) result = inflateReset(&stream);  // another member
  }
  inflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::runtime_error("not a whole gzip stream");
  return out;
}

/// A ball with a smooth edge: 1000 inside `radius` voxels about the centre, 0 far outside, in int16.
inline std::vector<std::int16_t> ball_voxels(int side, double radius) {
  std::vector<std::int16_t> voxels;
  const double centre = (side - 1) / 2.0;
  for (int z = 0; z < side; ++z)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const double distance = std::hypot(x - centre, y - centre, z - centre);
        voxels.push_back(
            static_cast<std::int16_t>(std::lround(500 * (1 - std::tanh((distance - radius) / 2)))));
      }
  return voxels;
}

/// A good small upload.
inline Bytes ball_file(int side = 24) {
  return make_nifti1<std::int16_t>({side, side, side}, {1, 1, 1}, ball_voxels(side, side / 3.0));
}

}  // namespace volsmooth::test
