#include "algorithms/formats/dicom/code_stream.h"

#include <gdcmBitmap.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>

#include <exception>
#include <optional>

#include "algorithms/formats/dicom/code_stream_header.h"
#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

/// As many bits as GDCM must be told that cells have stored, so that it takes the decoder that the stream
/// needs at once (a second one it tries by ways that abort) and leaves bits above those alone; nothing when
/// the stream is not what the attributes say.
std::optional<int> decoder_bits(const CodeStreamHeader& header, const PixelFormat& format) {
  using Kind = CodeStreamHeader::Kind;
  constexpr int kMostBits = 16;  // of all but JPEG 2000
  if (header.rows != static_cast<std::size_t>(format.rows) ||
      header.columns != static_cast<std::size_t>(format.columns) || header.components != 1 ||
      header.bits > format.bits_allocated)
    return std::nullopt;
  if (header.kind != Kind::kJpeg2000 && format.bits_allocated > kMostBits) return std::nullopt;
  if (header.kind != Kind::kJpegLossy) return format.bits_allocated;
  const int of_decoder = format.bits_allocated == kMostBits ? 12 : 8;
  return header.bits == of_decoder ? std::optional(of_decoder) : std::nullopt;
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

gdcm::Bitmap bitmap_of(std::span<const std::byte> stream, const std::string& uid, const PixelFormat& format,
                       int stored_bits) {
  gdcm::Bitmap bitmap;
  bitmap.SetTransferSyntax(gdcm::TransferSyntax::GetTSType(uid.c_str()));
  bitmap.SetNumberOfDimensions(2);
  bitmap.SetDimension(0, static_cast<unsigned>(format.columns));
  bitmap.SetDimension(1, static_cast<unsigned>(format.rows));
  bitmap.SetPixelFormat(gdcm::PixelFormat(
      1, static_cast<std::uint16_t>(format.bits_allocated), static_cast<std::uint16_t>(stored_bits),
      static_cast<std::uint16_t>(stored_bits - 1), static_cast<std::uint16_t>(format.is_signed ? 1 : 0)));
  bitmap.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  bitmap.SetDataElement(element_of(stream));
  return bitmap;
}

}  // namespace

std::vector<std::byte> decode_code_stream(std::span<const std::byte> stream, const std::string& uid,
                                          const PixelFormat& format) {
  const bool jpeg2000 = uid.ends_with(".4.90") || uid.ends_with(".4.91");
  const auto header = jpeg2000 ? jpeg2000_header(stream) : jpeg_header(stream);
  const auto stored_bits = header ? decoder_bits(*header, format) : std::nullopt;
  if (!stored_bits)
    refuse_dicom("dicom-decode-failed", "The compressed pixels of a frame are not what its attributes say.");
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  const gdcm::Bitmap bitmap = bitmap_of(stream, uid, format, *stored_bits);
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
