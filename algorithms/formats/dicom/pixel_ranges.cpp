#include "algorithms/formats/dicom/pixel_ranges.h"

#include <algorithm>
#include <cstring>

#include "algorithms/formats/dicom/attributes.h"
#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

using Ranges = std::vector<ByteRange>;

constexpr Attribute kPixels{kPixelData, "OBOW", "PixelData"};

[[noreturn]] void bad_pixel_length(const char* what) {
  refuse_dicom("dicom-pixel-length", what);
}

std::vector<Ranges> native_ranges(const WalkedFile& file, const Element& pixels, std::int64_t frames,
                                  std::int64_t frame_bytes) {
  const auto size = static_cast<std::size_t>(frame_bytes);
  const std::size_t declared = static_cast<std::size_t>(frames) * size, even = declared + declared % 2;
  const bool fits = pixels.length == declared || pixels.length == even;
  if (file.value(pixels).size() < pixels.length) {
    if (!fits) refuse_dicom("dicom-bad-length", "The length of PixelData reaches beyond the end of a file.");
    bad_pixel_length("A file ends before its last pixel.");
  }
  if (!fits) bad_pixel_length("PixelData is not as long as rows, columns, frames and bits say.");
  std::vector<Ranges> ranges;
  for (std::size_t frame = 0; frame < static_cast<std::size_t>(frames); ++frame)
    ranges.push_back({{pixels.offset + frame * size, size}});
  return ranges;
}

std::vector<std::uint32_t> offset_table(const WalkedFile& file, const Element& table) {
  const auto value = file.value(table);
  std::vector<std::uint32_t> offsets(value.size() / sizeof(std::uint32_t));
  if (!offsets.empty()) std::memcpy(offsets.data(), value.data(), offsets.size() * sizeof(std::uint32_t));
  return offsets;
}

/// An offset is that of a frame's first item, from the end of the table.
std::vector<Ranges> by_offsets(const std::vector<std::uint32_t>& offsets, const Ranges& fragments) {
  constexpr std::size_t kItemHeader = 8;
  const std::size_t origin = fragments.front().offset - kItemHeader;
  std::vector<Ranges> ranges;
  for (const ByteRange& fragment : fragments) {
    const std::size_t offset = fragment.offset - kItemHeader - origin;
    if (ranges.size() < offsets.size() && offset == offsets[ranges.size()]) ranges.emplace_back();
    if (ranges.empty()) bad_pixel_length("The offset table of PixelData points at no fragment.");
    ranges.back().push_back(fragment);
  }
  if (ranges.size() != offsets.size())
    bad_pixel_length("The offset table of PixelData points at no fragment.");
  return ranges;
}

std::vector<Ranges> encapsulated_ranges(const WalkedFile& file, const Element& pixels, std::int64_t frames) {
  const auto& elements = file.elements();
  const auto first = static_cast<std::uint32_t>(&pixels - elements.data() + 1);
  if (first >= pixels.next) refuse_dicom("dicom-no-pixels", "PixelData of a file holds no fragment.");
  Ranges fragments;
  for (std::uint32_t i = first + 1; i < pixels.next; ++i)
    fragments.push_back({elements[i].offset, elements[i].length});
  const auto count = static_cast<std::size_t>(frames);
  if (fragments.empty()) refuse_dicom("dicom-no-pixels", "PixelData of a file holds no fragment.");
  if (count == 1) return {fragments};
  if (fragments.size() == count) {
    std::vector<Ranges> ranges;
    for (const ByteRange& fragment : fragments) ranges.push_back({fragment});
    return ranges;
  }
  const auto offsets = offset_table(file, elements[first]);
  if (offsets.size() != count) bad_pixel_length("PixelData has not as many fragments as there are frames.");
  return by_offsets(offsets, fragments);
}

}  // namespace

std::vector<Ranges> pixel_ranges(const WalkedFile& file, std::int64_t frames, std::int64_t frame_bytes) {
  const Element* pixels = Attributes(file).find(kPixels);
  if (pixels == nullptr) refuse_dicom("dicom-no-pixels", "A file has no PixelData (7fe0,0010).");
  const bool has_fragments = pixels->next > static_cast<std::uint32_t>(pixels - file.elements().data() + 1);
  if (!file.transfer_syntax().encapsulated) {
    if (has_fragments) bad_pixel_length("PixelData is in fragments, which its transfer syntax has none of.");
    return native_ranges(file, *pixels, frames, frame_bytes);
  }
  return encapsulated_ranges(file, *pixels, frames);
}

}  // namespace volsmooth
