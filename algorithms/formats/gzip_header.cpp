#include "algorithms/formats/gzip_header.h"

#include <vector>

#include "algorithms/formats/isal.h"

namespace volsmooth {
namespace {

constexpr std::size_t kMostHeaderBytes = 16384;

enum Flag : unsigned { kHeaderCrc = 2, kExtra = 4, kName = 8, kComment = 16, kReserved = 0xe0 };

/// Takes single bytes and keeps them for the header's checksum.
class HeaderBytes {
 public:
  explicit HeaderBytes(InputFile& file) : file_(file) {}

  /// The next byte, or 0 once something is wrong.
  unsigned take() {
    if (refusal_) return 0;
    const auto next = file_.next();
    if (next.empty()) {
      refusal_ = {"gzip-truncated", "The gzip file ends within a member's header."};
    } else if (taken_.size() == kMostHeaderBytes) {
      refusal_ = {"gzip-corrupt", "A gzip member's header is longer than 16 KiB."};
    } else {
      taken_.push_back(static_cast<unsigned char>(next[0]));
      file_.take(1);
      return taken_.back();
    }
    return 0;
  }

  unsigned take_uint16() {
    const unsigned low = take();
    return low | take() << 8;
  }

  void skip(unsigned count) {
    for (unsigned i = 0; i < count && !refusal_; ++i) take();
  }

  void skip_text() {
    while (take() != 0) {
    }
  }

  void require(bool good) {
    if (!refusal_ && !good) refusal_ = {"gzip-corrupt", "A gzip member's header is not valid."};
  }

  unsigned crc16() const { return isal::crc32(0, std::as_bytes(std::span(taken_))) & 0xffff; }

  const std::optional<Refusal>& refusal() const { return refusal_; }

 private:
  InputFile& file_;
  std::vector<unsigned char> taken_;
  std::optional<Refusal> refusal_;
};

}  // namespace

std::optional<Refusal> take_gzip_header(InputFile& file) {
  HeaderBytes bytes(file);
  bytes.require(bytes.take_uint16() == 0x8b1f);
  bytes.require(bytes.take() == 8);  // deflate, the only method there is
  const unsigned flags = bytes.take();
  bytes.require((flags & kReserved) == 0);
  bytes.skip(6);  // time, hints, operating system
  if (flags & kExtra) bytes.skip(bytes.take_uint16());
  if (flags & kName) bytes.skip_text();
  if (flags & kComment) bytes.skip_text();
  if (flags & kHeaderCrc) {
    const unsigned expected = bytes.crc16();
    bytes.require(bytes.take_uint16() == expected);
  }
  return bytes.refusal();
}

}  // namespace volsmooth
