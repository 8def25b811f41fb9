#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/system/nifti_bytes.h"

namespace volsmooth::test {

using namespace nifti1;
using std::int16_t;
using std::int32_t;
using std::int64_t;

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInf = std::numeric_limits<float>::infinity();

/// One upload and the answer it must get.
struct BadUpload {
  std::string name;
  std::function<Bytes()> file;
  int status;
  std::string slug;          ///< of the problem; empty for a good upload
  std::string query = {};    ///< of the upload
  std::string warning = {};  ///< how a warning of a good upload begins
};

inline Bytes good() {
  return ball_file(8);
}

inline std::function<Bytes()> good_with(std::vector<Edit> edits) {
  return [edits = std::move(edits)] { return edited(good(), edits); };
}

template <class... Size>
Edit dims(Size... size) {
  return put_all<int16_t>(kDim, {static_cast<int16_t>(size)...});
}

/// A NIfTI-2 header that declares int16 voxels of a size, and no data.
inline Bytes nifti2_header(std::initializer_list<int64_t> dim) {
  Bytes file(nifti2::kData, '\0');
  return edited(
      file, {put(0, int32_t{540}), Edit{4, Bytes("n+2\0\r\n\x1a\n", 8)}, put(nifti2::kDatatype, int16_t{4}),
             put(nifti2::kBitpix, int16_t{16}), put_all<int64_t>(nifti2::kDim, dim),
             put_all<double>(nifti2::kPixdim, {1, 1, 1, 1, 1, 1, 1, 1}),
             put(nifti2::kVoxOffset, int64_t{nifti2::kData}), put(nifti2::kSclSlope, 1.0)});
}

/// A good file whose extensions fill the bytes from 352 to the data.
inline Bytes with_extensions(const Bytes& extensions, std::size_t vox_offset) {
  Bytes file = good();
  Bytes area = extensions;
  area.resize(vox_offset - kData, '\0');
  file.insert(kData, area);
  return edited(file, {put(kVoxOffset, static_cast<float>(vox_offset)), put(kExtender, char{1})});
}

inline Bytes extension(int32_t esize) {
  return bytes_of(esize) + bytes_of(int32_t{6});
}

inline Bytes many_extensions(int count) {
  Bytes all;
  for (int i = 0; i < count; ++i) all += extension(16) + Bytes(8, 'x');
  return with_extensions(all, kData + all.size());
}

/// Every number of the header and the voxels with its bytes turned around.
inline Bytes big_endian() {
  Bytes file = good();
  const auto turn = [&](std::size_t offset, std::size_t width, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto begin = file.begin() + static_cast<std::ptrdiff_t>(offset + i * width);
      std::reverse(begin, begin + static_cast<std::ptrdiff_t>(width));
    }
  };
  turn(kSizeofHdr, 4, 1);
  turn(kDim, 2, 8);
  turn(56, 4, 3);  // intent parameters
  turn(kIntentCode, 2, 4);
  turn(kPixdim, 4, 11);
  turn(124, 4, 4);  // cal_max to toffset
  turn(kQformCode, 2, 2);
  turn(kQuaternB, 4, 18);
  turn(kData, 2, (file.size() - kData) / 2);
  return file;
}

inline Bytes float_file_with(float value) {
  std::vector<float> voxels(512, 1.F);
  voxels[100] = 7;
  voxels[200] = value;
  return make_nifti1<float>({8, 8, 8}, {1, 1, 1}, voxels);
}

inline Bytes gzip_of_zeros(std::size_t megabytes) {
  return gzip(Bytes(megabytes << 20, '\0'), 9);
}

/// A header of 1000 x 1000 x 200 int16 voxels and as many zero bytes as it declares: 400 MB in 0.4 MB.
inline Bytes bomb() {
  const Bytes head = edited(good().substr(0, kData), {dims(3, 1000, 1000, 200, 1, 1, 1, 1)});
  return gzip(head + Bytes(400'000'000, '\0'), 6);
}

inline Bytes repeated(const Bytes& member, int count) {
  Bytes all;
  for (int i = 0; i < count; ++i) all += member;
  return all;
}

/// A gzip header with the flag and a field that goes on and on.
inline Bytes endless_gzip_field(char flag) {
  Bytes head("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10);
  head[3] = flag;
  if (flag == 4) head += "\xff\xff";
  return head + Bytes(200'000, 'x');
}

inline Bytes last_byte_changed(Bytes file, std::size_t from_end) {
  file[file.size() - from_end] = static_cast<char>(file[file.size() - from_end] ^ 0x55);
  return file;
}

inline std::vector<BadUpload> nifti_rows() {
  const auto identity_rows = [](float xy) {
    return put_all(kSrow, {1.F, xy, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 0.F, 1.F, 0.F});
  };
  const auto qform = [](float b, float c, float d) {
    return std::vector{put(kQformCode, int16_t{1}), put(kSformCode, int16_t{0}),
                       put_all(kQuaternB, {b, c, d})};
  };
  return {
      {"N1Empty", [] { return Bytes(); }, 422, "empty-file"},
      {"N2HeaderCut", [] { return good().substr(0, 200); }, 422, "nifti-truncated-header"},
      {"N3DataShort", [] { return good().substr(0, kData + 100); }, 422, "nifti-truncated-data"},
      {"N4ExtraBytes", [] { return good() + Bytes(1000, 'x'); }, 422, "nifti-trailing-data"},
      {"N5SizeofHdr0", good_with({put(kSizeofHdr, int32_t{0})}), 422, "nifti-bad-header"},
      {"N5SizeofHdr347", good_with({put(kSizeofHdr, int32_t{347})}), 422, "nifti-bad-header"},
      {"N5SizeofHdr2to31", good_with({put(kSizeofHdr, 0x80000000U)}), 422, "nifti-bad-header"},
      {"N6Analyze", good_with({put(kMagic, int32_t{0})}), 415, "unsupported-format"},
      {"N7SplitPair", good_with({Edit{kMagic, Bytes("ni1\0", 4)}}), 422, "nifti-split-pair"},
      {"N8Dim0Is0", good_with({dims(0, 8, 8, 8)}), 422, "nifti-bad-dimensions"},
      {"N8Dim0Is8", good_with({dims(8, 8, 8, 8)}), 422, "nifti-bad-dimensions"},
      {"N8Dim0IsMinus3", good_with({dims(-3, 8, 8, 8)}), 422, "nifti-bad-dimensions"},
      {"N8Nifti2Dim0Is200",
       [] {
         return nifti2_header({200, 8, 8, 8});
       },
       422, "nifti-bad-dimensions"},
      {"N8Nifti2Dim0IsMinus5",
       [] {
         return nifti2_header({-5, 8, 8, 8});
       },
       422, "nifti-bad-dimensions"},
      {"N9Dim1Is0", good_with({dims(3, 0, 8, 8)}), 422, "nifti-bad-dimensions"},
      {"N9Dim2IsMinus8", good_with({dims(3, 8, -8, 8)}), 422, "nifti-bad-dimensions"},
      {"N10Huge7", good_with({dims(7, 32767, 32767, 32767, 32767, 32767, 32767, 32767)}), 422,
       "volume-too-large"},
      {"N10Huge3", good_with({dims(3, 32767, 32767, 32767)}), 422, "volume-too-large"},
      {"N11BigClaim",
       [] {
         return edited(good(),
                       {dims(3, 1200, 1200, 1200), put(kDatatype, int16_t{16}), put(kBitpix, int16_t{32})});
       },
       422, "nifti-truncated-data"},
      {"N12Overflow64",
       [] {
         return nifti2_header({3, int64_t{1} << 62, 2, 2, 1, 1, 1, 1});
       },
       422, "volume-too-large"},
      {"N13Wraps32",
       [] {
         return nifti2_header({3, int64_t{1} << 16, int64_t{1} << 16, 2, 1, 1, 1, 1});
       },
       422, "volume-too-large"},
      {"N14Series", [] { return edited(good(), {dims(4, 8, 8, 4, 2)}); }, 422, "unsupported-dimensionality"},
      {"N14VectorIntent",
       [] {
         return edited(good(), {dims(5, 8, 8, 4, 1, 2), put(kIntentCode, int16_t{1007})});
       },
       422, "unsupported-dimensionality"},
      {"N14OneOfSeries", [] { return edited(good(), {dims(4, 8, 8, 4, 2)}); }, 201, "", "?volume_index=1"},
      {"N16Datatype999", good_with({put(kDatatype, int16_t{999})}), 422, "unsupported-datatype"},
      {"N16Datatype0", good_with({put(kDatatype, int16_t{0})}), 422, "unsupported-datatype"},
      {"N16Bit", good_with({put(kDatatype, int16_t{1}), put(kBitpix, int16_t{1})}), 422,
       "unsupported-datatype"},
      {"N17Rgb", good_with({put(kDatatype, int16_t{128}), put(kBitpix, int16_t{24})}), 422,
       "unsupported-datatype"},
      {"N17Complex", good_with({put(kDatatype, int16_t{32}), put(kBitpix, int16_t{64})}), 422,
       "unsupported-datatype"},
      {"N17Float128", good_with({put(kDatatype, int16_t{1536}), put(kBitpix, int16_t{128})}), 422,
       "unsupported-datatype"},
      {"N18Bitpix", good_with({put(kBitpix, int16_t{8})}), 422, "nifti-bad-header"},
      {"N19PixdimNan", good_with({put(kPixdim + 4, kNan)}), 422, "nifti-bad-spacing"},
      {"N19PixdimInf", good_with({put(kPixdim + 8, kInf)}), 422, "nifti-bad-spacing"},
      {"N20Pixdim0", good_with({put(kPixdim + 4, 0.F)}), 422, "nifti-bad-spacing"},
      {"N20PixdimNegative", good_with({put(kPixdim + 4, -1.F)}), 422, "nifti-bad-spacing"},
      {"N20PixdimTiny", good_with({put(kPixdim + 4, 1e-30F)}), 422, "nifti-bad-spacing"},
      {"N20PixdimHuge", good_with({put(kPixdim + 4, 1e30F)}), 422, "nifti-bad-spacing"},
      {"N21Ratio", good_with({put(kPixdim + 4, 2000.F), put(kSrow, 2000.F)}), 422, "nifti-bad-spacing"},
      {"N22OffsetNan", good_with({put(kVoxOffset, kNan)}), 422, "nifti-bad-offset"},
      {"N22OffsetInf", good_with({put(kVoxOffset, kInf)}), 422, "nifti-bad-offset"},
      {"N22OffsetHuge", good_with({put(kVoxOffset, 1e30F)}), 422, "nifti-bad-offset"},
      {"N23OffsetNegative", good_with({put(kVoxOffset, -352.F)}), 422, "nifti-bad-offset"},
      {"N23Offset0", good_with({put(kVoxOffset, 0.F)}), 422, "nifti-bad-offset"},
      {"N23Offset100", good_with({put(kVoxOffset, 100.F)}), 422, "nifti-bad-offset"},
      {"N23OffsetOdd",
       [] {
         Bytes file = good();
         file.insert(kData, 4, '\0');
         return edited(file, {put(kVoxOffset, 356.F)});
       },
       201, "", "", "offset-unaligned"},
      {"N24SlopeNan", good_with({put(kSclSlope, kNan)}), 422, "nifti-bad-scaling"},
      {"N24InterInf", good_with({put(kSclInter, kInf)}), 422, "nifti-bad-scaling"},
      {"N25SlopeOverflows", good_with({put(kSclSlope, 1e38F)}), 422, "nifti-bad-scaling"},
      {"N26SrowNan", good_with({put(kSrow, kNan)}), 422, "nifti-bad-orientation"},
      {"N27SrowZero", good_with({Edit{kSrow, Bytes(48, '\0')}}), 422, "nifti-bad-orientation"},
      {"N27SrowSingular",
       good_with({put_all(kSrow, {1.F, 1.F, 0.F, 0.F, 1.F, 1.F, 0.F, 0.F, 0.F, 0.F, 1.F, 0.F})}), 422,
       "nifti-bad-orientation"},
      {"N29QuaternionLong", good_with(qform(1, 1, 1)), 422, "nifti-bad-orientation"},
      {"N29QuaternionNan", good_with(qform(kNan, 0, 0)), 422, "nifti-bad-orientation"},
      {"N28Sheared", good_with({identity_rows(0.3F)}), 201, ""},
      {"N30FormsDisagree", good_with({put(kQformCode, int16_t{1}), put(kQuaternB, 1.F)}), 201, "", "",
       "forms-disagree"},
      {"N31NoOrientation", good_with({put(kSformCode, int16_t{0})}), 201, "", "", "orientation-unknown"},
      {"N32EsizeHuge", [] { return with_extensions(extension(0x7ffffff0), 368); }, 422,
       "nifti-bad-extension"},
      {"N33EsizeNegative", [] { return with_extensions(extension(-16), 368); }, 422, "nifti-bad-extension"},
      {"N33Esize7", [] { return with_extensions(extension(7), 368); }, 422, "nifti-bad-extension"},
      {"N33PastOffset", [] { return with_extensions(extension(32), 368); }, 422, "nifti-bad-extension"},
      {"N34MillionExtensions", [] { return many_extensions(1'000'000); }, 422, "nifti-bad-extension"},
      {"N35BigEndian", big_endian, 201, ""},
      {"N36MixedEndian",
       [] {
         Bytes file = good();
         const Bytes big = big_endian();
         file.replace(kPixdim, 44, big.substr(kPixdim, 44));
         return file;
       },
       422, "nifti-bad-header"},
      {"N37Nan", [] { return float_file_with(kNan); }, 422, "non-finite-voxels"},
      {"N37Inf", [] { return float_file_with(-kInf); }, 422, "non-finite-voxels"},
      {"N37Replaced", [] { return float_file_with(kNan); }, 201, "", "?non_finite=0"},
      {"N38Descrip",
       good_with({Edit{kDescrip, "../../etc/passwd<script>alert(1)</script>\x01\x1b[2J"},
                  Edit{kAuxFile, "../../etc/passwd"}}),
       201, ""},
      {"N39AsciiNia", [] { return Bytes("<nifti_image\n nifti_type = 'NIFTI-1A'\n/>\n") + Bytes(400, ' '); },
       415, "unsupported-format"},
      {"N40Micron", good_with({put(kXyztUnits, char{3})}), 201, ""},
      {"N40UnitsUnknown", good_with({put(kXyztUnits, char{0})}), 201, "", "", "units-unknown"},
  };
}

inline std::vector<BadUpload> gzip_rows() {
  return {
      {"G1Cut",
       [] {
         const Bytes file = gzip(good());
         return file.substr(0, file.size() / 2);
       },
       422, "gzip-truncated"},
      {"G2Crc", [] { return last_byte_changed(gzip(good()), 8); }, 422, "gzip-corrupt"},
      {"G2Isize", [] { return last_byte_changed(gzip(good()), 4); }, 422, "gzip-corrupt"},
      {"G3Bomb", bomb, 413, "decompression-limit"},
      {"G4LongerThanHeader", [] { return gzip(good()) + gzip_of_zeros(64); }, 422, "nifti-trailing-data"},
      {"G5Garbage", [] { return gzip(good()) + "garbage after the member"; }, 422, "gzip-trailing-data"},
      {"G6TwoMembers", [] { return gzip(good().substr(0, 700)) + gzip(good().substr(700)); }, 201, ""},
      {"G7MillionMembers", [] { return gzip(good()) + repeated(gzip(""), 1'000'000); }, 413,
       "decompression-limit"},
      {"G8Nested", [] { return gzip(gzip(good())); }, 415, "nested-compression"},
      {"G9EndlessName", [] { return endless_gzip_field(8); }, 422, "gzip-corrupt"},
      {"G9EndlessExtra", [] { return endless_gzip_field(4); }, 422, "gzip-corrupt"},
      {"G10NoNameNeeded", [] { return gzip(good()); }, 201, ""},
      {"G11ReservedBlock",
       [] { return Bytes("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10) + "\x07" + Bytes(64, '\0'); }, 422,
       "gzip-corrupt"},
      {"G11BadDistance",
       // A fixed-code block whose first symbol is a match: there is nothing to copy from.
       [] { return Bytes("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10) + "\x03\x02" + Bytes(64, '\0'); }, 422,
       "gzip-corrupt"},
      {"G12Zstd", [] { return Bytes("\x28\xb5\x2f\xfd") + Bytes(400, '\0'); }, 415, "unsupported-format"},
      {"G12Xz",
       [] {
         return Bytes(
                    "\xfd"
                    "7zXZ\0",
                    6) +
                Bytes(400, '\0');
       },
       415, "unsupported-format"},
      {"G12Bzip2", [] { return "BZh9" + Bytes(400, '\0'); }, 415, "unsupported-format"},
  };
}

}  // namespace volsmooth::test
