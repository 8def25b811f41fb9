#include "algorithms/formats/dicom/pixels.h"

#include <bit>
#include <cstring>
#include <type_traits>

#include "algorithms/formats/byte_order.h"
#include "algorithms/formats/dicom/code_stream.h"
#include "algorithms/formats/dicom/elements.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/run_length.h"
#include "algorithms/formats/dicom/uploaded_files.h"

namespace volsmooth {
namespace {

constexpr std::string_view kRunLengths = "1.2.840.10008.1.2.5";

/// Values of the lowest `stored_bits` of each cell; the bits above them must be 0 or repeat the sign.
template <class Cell>
std::vector<std::int32_t> values_of(std::span<const std::byte> cells, bool swapped,
                                    const PixelFormat& format) {
  using Wide = std::conditional_t<std::is_signed_v<Cell>, std::int32_t, std::uint32_t>;
  const int unused = 32 - format.bits_stored, sign_bit = format.bits_stored - 1;
  std::vector<std::int32_t> values(cells.size() / sizeof(Cell));
  bool clean = true;
  for (std::size_t i = 0; i < values.size(); ++i) {
    Cell cell;
    std::memcpy(&cell, cells.data() + i * sizeof(Cell), sizeof(Cell));
    if (swapped) cell = byte_swapped(cell);
    const auto raw = static_cast<std::uint32_t>(static_cast<std::make_unsigned_t<Cell>>(cell));
    const auto value = static_cast<Wide>(raw << unused) >> unused;
    clean &= static_cast<int>(value == static_cast<Wide>(cell)) | static_cast<int>(raw >> sign_bit >> 1 == 0);
    values[i] = static_cast<std::int32_t>(value);
  }
  if (!clean)
    refuse_dicom("dicom-bad-pixel-format", "Bits beyond the stored ones are in use, perhaps by an overlay.");
  return values;
}

std::vector<std::int32_t> values_of(std::span<const std::byte> cells, bool swapped,
                                    const PixelFormat& format) {
  switch (format.bits_allocated * (format.is_signed ? -1 : 1)) {
    case 8:
      return values_of<std::uint8_t>(cells, swapped, format);
    case -8:
      return values_of<std::int8_t>(cells, swapped, format);
    case 16:
      return values_of<std::uint16_t>(cells, swapped, format);
    case -16:
      return values_of<std::int16_t>(cells, swapped, format);
    case 32:
      return values_of<std::uint32_t>(cells, swapped, format);
    default:
      return values_of<std::int32_t>(cells, swapped, format);
  }
}

std::vector<std::byte> joined(std::span<const std::byte> file, const std::vector<ByteRange>& ranges) {
  std::vector<std::byte> bytes;
  for (const ByteRange& range : ranges) {
    const auto part = file.subspan(range.offset, range.length);
    bytes.insert(bytes.end(), part.begin(), part.end());
  }
  return bytes;
}

}  // namespace

std::vector<std::int32_t> stored_values(std::span<const std::byte> file, const DicomSlice& slice,
                                        const PixelFormat& format) {
  const TransferSyntax* syntax = find_transfer_syntax(slice.transfer_syntax_uid);
  if (!syntax->encapsulated) {
    const ByteRange& range = slice.pixels.front();
    return values_of(file.subspan(range.offset, range.length), syntax->big_endian, format);
  }
  const std::vector<std::byte> packed = joined(file, slice.pixels);
  const std::vector<std::byte> cells =
      syntax->uid == kRunLengths
          ? decode_run_lengths(packed, static_cast<std::size_t>(format.rows * format.columns),
                               static_cast<std::size_t>(format.bits_allocated / 8))
          : decode_code_stream(packed, slice.transfer_syntax_uid, format);
  return values_of(cells, false, format);
}

tl::expected<std::vector<std::int32_t>, Refusal> decode_slice(const DicomSeries& series,
                                                              const DicomSlice& slice) {
  const auto file = series.files->open(slice.file);
  if (!file) return tl::unexpected(file.error());
  return or_refusal([&] { return stored_values(file->bytes, slice, series.format); });
}

}  // namespace volsmooth
