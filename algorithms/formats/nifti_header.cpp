#include "algorithms/formats/nifti_header.h"

#include <algorithm>
#include <bit>
#include <string_view>

#include "algorithms/formats/byte_order.h"
#include "algorithms/formats/nifti_limits.h"

namespace volsmooth {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t kMagic1At = offsetof(Nifti1Header, magic), kMagic2At = offsetof(Nifti2Header, magic);

bool has(std::span<const std::byte> head, std::size_t at, std::string_view text) {
  return head.size() >= at + text.size() && std::memcmp(head.data() + at, text.data(), text.size()) == 0;
}

/// Calls `visit` with every number of a header that is longer than a byte.
template <class Header, class Visit>
void for_each_number(Header& h, const Visit& visit) {
  const auto each = [&](auto&... fields) { (visit(fields), ...); };
  each(h.sizeof_hdr, h.intent_p1, h.intent_p2, h.intent_p3, h.intent_code, h.datatype, h.bitpix);
  each(h.slice_start, h.slice_end, h.slice_code, h.slice_duration, h.toffset, h.xyzt_units);
  each(h.vox_offset, h.scl_slope, h.scl_inter, h.cal_max, h.cal_min, h.qform_code, h.sform_code);
  each(h.quatern_b, h.quatern_c, h.quatern_d, h.qoffset_x, h.qoffset_y, h.qoffset_z);
  for (auto* row : {h.srow_x, h.srow_y, h.srow_z}) std::for_each_n(row, 4, visit);
  std::for_each_n(h.dim, 8, visit);
  std::for_each_n(h.pixdim, 8, visit);
  if constexpr (Header::kVersion == 1) each(h.extents, h.session_error, h.glmax, h.glmin);
}

template <class Header>
Header swapped(Header header) {
  for_each_number(header, [](auto& number) { number = byte_swapped(number); });
  return header;
}

/// Whether a group of fields makes sense in the other byte order only, though the header's size does in this
/// one.
template <class Header>
bool mixes_byte_orders(const Header& header) {
  const Header other = swapped(header);
  const auto only_other = [&](const auto& makes_sense) { return !makes_sense(header) && makes_sense(other); };
  return only_other([](const Header& h) { return h.dim[0] >= 1 && h.dim[0] <= 7; }) ||
         only_other([](const Header& h) {
           return is_data_offset(static_cast<double>(h.vox_offset), Header::kVersion);
         }) ||
         only_other([](const Header& h) {
           return std::all_of(h.pixdim + 1, h.pixdim + 4, [](double step) { return is_spacing(step); });
         });
}

template <class Header>
NiftiFields fields_of(const Header& h) {
  NiftiFields fields{.version = Header::kVersion,
                     .datatype = h.datatype,
                     .bitpix = h.bitpix,
                     .intent_code = h.intent_code,
                     .xyzt_units = h.xyzt_units,
                     .qform_code = h.qform_code,
                     .sform_code = h.sform_code,
                     .vox_offset = static_cast<double>(h.vox_offset),
                     .scl_slope = h.scl_slope,
                     .scl_inter = h.scl_inter,
                     .quatern = {h.quatern_b, h.quatern_c, h.quatern_d},
                     .qoffset = {h.qoffset_x, h.qoffset_y, h.qoffset_z}};
  std::ranges::copy(h.dim, fields.dim.begin());
  std::ranges::copy(h.pixdim, fields.pixdim.begin());
  std::ranges::copy(h.srow_x, fields.srow[0].begin());
  std::ranges::copy(h.srow_y, fields.srow[1].begin());
  std::ranges::copy(h.srow_z, fields.srow[2].begin());
  return fields;
}

template <class Header>
tl::expected<ParsedHeader, Refusal> parse(std::span<const std::byte> bytes) {
  if (bytes.size() < Header::kBytes) {
    return refuse("nifti-truncated-header",
                  "The file ends within its NIfTI header of " + std::to_string(Header::kBytes) + " bytes.");
  }
  ParsedHeader parsed;
  auto header = header_from<Header>(bytes);
  parsed.swapped = header.sizeof_hdr != static_cast<std::int32_t>(Header::kBytes);
  if (parsed.swapped) header = swapped(header);
  if (mixes_byte_orders(header)) {
    return refuse("nifti-bad-header", "Fields of the NIfTI header are in differing byte orders.");
  }
  parsed.header = {Header::kVersion, bytes_of(header)};
  parsed.fields = fields_of(header);
  return parsed;
}

/// The size that the header states of itself in either byte order, or 0 if it is none of a NIfTI header.
std::size_t stated_size(std::span<const std::byte> head) {
  if (head.size() < sizeof(std::int32_t)) return 0;
  std::int32_t size = 0;
  std::memcpy(&size, head.data(), sizeof size);
  for (const std::size_t known : {Nifti1Header::kBytes, Nifti2Header::kBytes}) {
    const auto expected = static_cast<std::int32_t>(known);
    if (size == expected || size == byte_swapped(expected)) return known;
  }
  return 0;
}

tl::expected<ParsedHeader, Refusal> identify(std::span<const std::byte> head, bool inflated) {
  if (head.empty()) return refuse("empty-file", "The file has no content.");
  if (const auto compression = compression_of(head)) {
    const std::string name(*compression);
    if (inflated)
      return refuse("nested-compression", "The gzip file holds " + name + " data. Unpack it once.");
    return refuse("unsupported-format", "The file is in " + name + " format. Send .nii or .nii.gz.");
  }
  const std::size_t size = stated_size(head);
  const bool is_magic1 = has(head, kMagic1At, "n+1\0"sv);
  const bool is_magic2 = has(head, kMagic2At, "n+2\0\r\n\x1a\n"sv);
  if ((size == 348 && has(head, kMagic1At, "ni1\0"sv)) || (size == 540 && has(head, kMagic2At, "ni2\0"sv))) {
    return refuse("nifti-split-pair",
                  "The header belongs to a pair of .hdr and .img. Join them to one .nii.");
  }
  if (size == Nifti1Header::kBytes && (is_magic1 || head.size() < Nifti1Header::kBytes)) {
    return parse<Nifti1Header>(head);
  }
  if (size == Nifti2Header::kBytes && (is_magic2 || head.size() < kMagic2At + sizeof(Nifti2Header::magic))) {
    return parse<Nifti2Header>(head);
  }
  if (is_magic1 || is_magic2 || size == Nifti2Header::kBytes) {
    return refuse("nifti-bad-header", "The size that the NIfTI header states and its magic do not agree.");
  }
  return refuse("unsupported-format", "The content is neither NIfTI-1 nor NIfTI-2 (.nii or .nii.gz).");
}

}  // namespace

tl::expected<ParsedHeader, Refusal> read_header(ByteSource& source) {
  std::array<std::byte, Nifti2Header::kBytes> head;
  const auto first = source.read(std::span(head).first(Nifti1Header::kBytes));
  if (!first) return tl::unexpected(first.error());
  std::size_t filled = *first;
  if (filled == Nifti1Header::kBytes && stated_size(head) == Nifti2Header::kBytes) {
    const auto rest = source.read(std::span(head).subspan(filled));
    if (!rest) return tl::unexpected(rest.error());
    filled += *rest;
  }
  return identify(std::span(head).first(filled), source.is_gzip());
}

}  // namespace volsmooth
