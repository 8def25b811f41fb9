#include "algorithms/formats/byte_source.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

namespace volsmooth {
namespace {

using namespace std::string_view_literals;

struct Signature {
  std::string_view name, bytes;
};

constexpr std::array kCompressions{
    Signature{"gzip", "\x1f\x8b"sv},        Signature{"zstd", "\x28\xb5\x2f\xfd"sv},
    Signature{"xz", "\xfd\x37zXZ\0"sv},     Signature{"bzip2", "BZh"sv},
    Signature{"lz4", "\x04\x22\x4d\x18"sv}, Signature{"zip", "PK\x03\x04"sv},
    Signature{"compress", "\x1f\x9d"sv},
};

constexpr std::int64_t kSkipBytes = std::int64_t{256} << 10;

}  // namespace

std::optional<std::string_view> compression_of(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  for (const Signature& signature : kCompressions) {
    if (text.starts_with(signature.bytes)) return signature.name;
  }
  return std::nullopt;
}

ByteSource::ByteSource(const std::filesystem::path& file, const ReadLimits& limits) : file_(file) {
  if (looks_like_gzip(file_.next())) gzip_.emplace(file_, limits);
}

tl::expected<std::size_t, Refusal> ByteSource::read(std::span<std::byte> out) {
  if (gzip_) return gzip_->read(out);
  std::size_t filled = 0;
  while (filled < out.size()) {
    const auto next = file_.next();
    if (next.empty()) break;
    const std::size_t count = std::min(next.size(), out.size() - filled);
    std::memcpy(out.data() + filled, next.data(), count);
    file_.take(count);
    filled += count;
  }
  return filled;
}

tl::expected<std::int64_t, Refusal> ByteSource::skip(std::int64_t count,
                                                     const std::function<void()>& after_chunk) {
  std::vector<std::byte> passed(static_cast<std::size_t>(std::min(count, kSkipBytes)));
  std::int64_t skipped = 0;
  while (skipped < count) {
    const auto part = static_cast<std::size_t>(std::min(count - skipped, kSkipBytes));
    const auto got = read(std::span(passed).first(part));
    if (!got) return tl::unexpected(got.error());
    skipped += static_cast<std::int64_t>(*got);
    if (*got < part) break;
    after_chunk();
  }
  return skipped;
}

double ByteSource::fraction_read() const {
  return file_.size() > 0 ? static_cast<double>(file_.taken()) / static_cast<double>(file_.size()) : 1;
}

}  // namespace volsmooth
