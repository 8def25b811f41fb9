#include "service/storage/checked_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace volsmooth {
namespace {

constexpr std::int64_t kBlock = BlockSums::kBlockBytes;

std::int64_t size_of(const FileDescriptor& file) {
  struct stat found {};
  if (::fstat(file.get(), &found) != 0) throw std::system_error(errno, std::generic_category(), "fstat");
  return found.st_size;
}

}  // namespace

CheckedFile::CheckedFile(const std::filesystem::path& path, std::int64_t bytes, BlockSums sums,
                         std::function<void()> on_damage)
    : file_(open_file(path, O_RDONLY | O_NOFOLLOW)),
      bytes_(bytes),
      sums_(std::move(sums)),
      on_damage_(std::move(on_damage)) {
  if (size_of(file_) != bytes_) report_damage();
}

void CheckedFile::read(std::int64_t offset, std::span<std::byte> into) const {
  std::vector<std::byte> whole;  // of a block of which only a part is wanted
  while (!into.empty()) {
    const std::int64_t block = offset / kBlock, from = offset % kBlock, length = length_of(block);
    const auto wanted =
        static_cast<std::size_t>(std::min(length - from, static_cast<std::int64_t>(into.size())));
    if (static_cast<std::int64_t>(wanted) == length) {
      read_block(block, into.first(wanted));
    } else {
      whole.resize(static_cast<std::size_t>(length));
      read_block(block, whole);
      std::ranges::copy(std::span(whole).subspan(static_cast<std::size_t>(from), wanted), into.begin());
    }
    into = into.subspan(wanted);
    offset += static_cast<std::int64_t>(wanted);
  }
}

void CheckedFile::check(std::int64_t offset) const {
  if (offset >= bytes_) return;
  std::vector<std::byte> block(static_cast<std::size_t>(length_of(offset / kBlock)));
  read_block(offset / kBlock, block);
}

void CheckedFile::read_block(std::int64_t block, std::span<std::byte> into) const {
  if (read_at(file_, block * kBlock, into) != into.size() ||
      !sums_.fit(static_cast<std::size_t>(block), into))
    report_damage();
}

std::int64_t CheckedFile::length_of(std::int64_t block) const {
  return std::clamp<std::int64_t>(bytes_ - block * kBlock, 0, kBlock);
}

void CheckedFile::report_damage() const {
  on_damage_();
  throw DamagedFile();
}

}  // namespace volsmooth
