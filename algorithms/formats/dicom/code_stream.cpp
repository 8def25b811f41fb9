#include "algorithms/formats/dicom/code_stream.h"

#include <gdcmBitmap.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>

#include <exception>
#include <optional>

#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

struct StreamHeader {
  std::size_t rows = 0, columns = 0, components = 0, bits = 0;
};

std::size_t at(std::span<const std::byte> stream, std::size_t offset) {
  return static_cast<std::size_t>(stream[offset]);
}

std::size_t number(std::span<const std::byte> stream, std::size_t offset, std::size_t bytes) {
  std::size_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | at(stream, offset + i);
  return value;
}

/// The frame header of a JPEG or JPEG-LS stream: the first SOFn among the markers before the first scan.
std::optional<StreamHeader> jpeg_header(std::span<const std::byte> stream) {
  constexpr std::size_t kStart = 0xffd8, kScan = 0xffda, kLsFrame = 0xfff7;
  if (stream.size() < 4 || number(stream, 0, 2) != kStart) return std::nullopt;
  for (std::size_t offset = 2; offset + 4 <= stream.size();) {
    const std::size_t marker = number(stream, offset, 2);
    if (marker == 0xffff) {  // fill byte
      ++offset;
      continue;
    }
    const std::size_t length = number(stream, offset + 2, 2);
    const bool frame = marker == kLsFrame || ((marker & 0xfff0) == 0xffc0 && marker != 0xffc4 &&
                                              marker != 0xffc8 && marker != 0xffcc);
    if (marker >> 8 != 0xff || marker == kScan || length < 2) return std::nullopt;
    if (frame) {
      if (offset + 10 > stream.size()) return std::nullopt;
      return StreamHeader{number(stream, offset + 5, 2), number(stream, offset + 7, 2),
                          at(stream, offset + 9), at(stream, offset + 4)};
    }
    offset += 2 + length;
  }
  return std::nullopt;
}

/// SOC and SIZ of a JPEG 2000 code stream (ISO 15444-1, A.5.1), or of one in a JP2 file, which some writers
/// make.
std::optional<StreamHeader> jpeg2000_header(std::span<const std::byte> stream) {
  constexpr std::size_t kBegin = 0xff4fff51, kSizBytes = 45;
  if (stream.size() < kSizBytes || number(stream, 0, 4) != kBegin) return std::nullopt;
  const std::size_t columns = number(stream, 8, 4) - number(stream, 16, 4);
  const std::size_t rows = number(stream, 12, 4) - number(stream, 20, 4);
  return StreamHeader{rows, columns, number(stream, 40, 2), (at(stream, 42) & 0x7f) + 1};
}

void check(const std::optional<StreamHeader>& header, const PixelFormat& format) {
  const bool fits = header && header->rows == static_cast<std::size_t>(format.rows) &&
                    header->columns == static_cast<std::size_t>(format.columns) && header->components == 1 &&
                    header->bits <= static_cast<std::size_t>(format.bits_allocated);
  if (!fits)
    refuse_dicom("dicom-decode-failed", "The compressed pixels of a frame are not what its attributes say.");
}

gdcm::DataElement element_of(std::span<const std::byte> stream) {
  const gdcm::SmartPointer<gdcm::SequenceOfFragments> fragments = new gdcm::SequenceOfFragments;
  gdcm::Fragment fragment;
  fragment.SetByteValue(reinterpret_cast<const char*>(stream.data()),
                        static_cast<std::uint32_t>(stream.size()));
  fragments->AddFragment(fragment);
  gdcm::DataElement element(gdcm::Tag(0x7fe0, 0x0010), gdcm::VL(0xffffffff), gdcm::VR::OB);
  element.SetValue(*fragments);
  return element;
}

gdcm::Bitmap bitmap_of(std::span<const std::byte> stream, const std::string& uid, const PixelFormat& format) {
  gdcm::Bitmap bitmap;
  bitmap.SetTransferSyntax(gdcm::TransferSyntax::GetTSType(uid.c_str()));
  bitmap.SetNumberOfDimensions(2);
  bitmap.SetDimension(0, static_cast<unsigned>(format.columns));
  bitmap.SetDimension(1, static_cast<unsigned>(format.rows));
  bitmap.SetPixelFormat(gdcm::PixelFormat(1, static_cast<std::uint16_t>(format.bits_allocated),
                                          static_cast<std::uint16_t>(format.bits_stored),
                                          static_cast<std::uint16_t>(format.bits_stored - 1),
                                          static_cast<std::uint16_t>(format.is_signed ? 1 : 0)));
  bitmap.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  bitmap.SetDataElement(element_of(stream));
  return bitmap;
}

}  // namespace

std::vector<std::byte> decode_code_stream(std::span<const std::byte> stream, const std::string& uid,
                                          const PixelFormat& format) {
  const bool jpeg2000 = uid.ends_with(".4.90") || uid.ends_with(".4.91");
  check(jpeg2000 ? jpeg2000_header(stream) : jpeg_header(stream), format);
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  const gdcm::Bitmap bitmap = bitmap_of(stream, uid, format);
  std::vector<std::byte> cells(
      static_cast<std::size_t>(format.rows * format.columns * (format.bits_allocated / 8)));
  bool decoded = false;
  try {
    decoded =
        bitmap.GetBufferLength() == cells.size() && bitmap.GetBuffer(reinterpret_cast<char*>(cells.data()));
  } catch (const std::exception&) {  // GDCM's way of saying the same
  }
  if (!decoded) refuse_dicom("dicom-decode-failed", "The compressed pixels of a frame cannot be decoded.");
  return cells;
}

}  // namespace volsmooth
