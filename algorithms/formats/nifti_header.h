#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "algorithms/formats/byte_source.h"
#include "algorithms/formats/nifti.h"

namespace volsmooth {

/// The NIfTI-1 header as it lies in the file (nifti1.h of the NIfTI Data Format Working Group).
struct Nifti1Header {
  static constexpr int kVersion = 1;
  static constexpr std::size_t kBytes = 348;

  std::int32_t sizeof_hdr;
  char data_type[10], db_name[18];
  std::int32_t extents;
  std::int16_t session_error;
  char regular, dim_info;
  std::int16_t dim[8];
  float intent_p1, intent_p2, intent_p3;
  std::int16_t intent_code, datatype, bitpix, slice_start;
  float pixdim[8];
  float vox_offset, scl_slope, scl_inter;
  std::int16_t slice_end;
  char slice_code, xyzt_units;
  float cal_max, cal_min, slice_duration, toffset;
  std::int32_t glmax, glmin;
  char descrip[80], aux_file[24];
  std::int16_t qform_code, sform_code;
  float quatern_b, quatern_c, quatern_d, qoffset_x, qoffset_y, qoffset_z;
  float srow_x[4], srow_y[4], srow_z[4];
  char intent_name[16], magic[4];
};
static_assert(sizeof(Nifti1Header) == Nifti1Header::kBytes);

/// The NIfTI-2 header as it lies in the file (nifti2.h). Its end is not aligned: only `kBytes` count.
struct Nifti2Header {
  static constexpr int kVersion = 2;
  static constexpr std::size_t kBytes = 540;

  std::int32_t sizeof_hdr;
  char magic[8];
  std::int16_t datatype, bitpix;
  std::int64_t dim[8];
  double intent_p1, intent_p2, intent_p3;
  double pixdim[8];
  std::int64_t vox_offset;
  double scl_slope, scl_inter, cal_max, cal_min, slice_duration, toffset;
  std::int64_t slice_start, slice_end;
  char descrip[80], aux_file[24];
  std::int32_t qform_code, sform_code;
  double quatern_b, quatern_c, quatern_d, qoffset_x, qoffset_y, qoffset_z;
  double srow_x[4], srow_y[4], srow_z[4];
  std::int32_t slice_code, xyzt_units, intent_code;
  char intent_name[16], dim_info, unused_str[15];
};
static_assert(offsetof(Nifti2Header, unused_str) + sizeof(Nifti2Header::unused_str) == Nifti2Header::kBytes);

/// What of a header decides how the file is read, the same for both versions.
struct NiftiFields {
  int version = 1;
  std::array<std::int64_t, 8> dim{};
  int datatype = 0, bitpix = 0, intent_code = 0, xyzt_units = 0, qform_code = 0, sform_code = 0;
  std::array<double, 8> pixdim{};
  double vox_offset = 0, scl_slope = 0, scl_inter = 0;
  std::array<double, 3> quatern{}, qoffset{};
  std::array<std::array<double, 4>, 3> srow{};
};

struct ParsedHeader {
  NiftiHeader header;
  NiftiFields fields;
  bool swapped = false;  ///< the file is in the other byte order than this machine
};

/// Takes the header from the front of `source` and turns it to native byte order; its fields are not checked
/// yet. Refusals: empty-file, unsupported-format, nested-compression, nifti-truncated-header,
/// nifti-bad-header (no size of a header, or fields in differing byte orders), nifti-split-pair.
tl::expected<ParsedHeader, Refusal> read_header(ByteSource& source);

template <class Header>
Header header_from(std::span<const std::byte> bytes) {
  Header header{};
  std::memcpy(&header, bytes.data(), Header::kBytes);
  return header;
}

template <class Header>
std::vector<std::byte> bytes_of(const Header& header) {
  std::vector<std::byte> bytes(Header::kBytes);
  std::memcpy(bytes.data(), &header, Header::kBytes);
  return bytes;
}

}  // namespace volsmooth
