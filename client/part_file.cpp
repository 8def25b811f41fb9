#include "client/part_file.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

namespace volsmooth {
namespace {

mode_t current_umask() {
  const mode_t mask = umask(0);
  umask(mask);
  return mask;
}

std::string hex(const unsigned char* bytes, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", bytes[i]);
    text += digits.data();
  }
  return text;
}

/// Renames without replacing. File systems that cannot (EINVAL) get a hard link, which does not replace
/// either.
int rename_to_new(const char* from, const char* to) {
  if (renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return -1;
  return link(from, to) == 0 ? unlink(from) : -1;
}

}  // namespace

void PartFile::HashDeleter::operator()(void* context) const {
  EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(context));
}

PartFile::PartFile(std::filesystem::path final_path, std::string temporary, Descriptor descriptor)
    : final_path_(std::move(final_path)),
      temporary_(std::move(temporary)),
      descriptor_(std::move(descriptor)),
      hash_(EVP_MD_CTX_new()) {
  if (EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(hash_.get()), EVP_sha256(), nullptr) != 1)
    throw std::bad_alloc();
}

PartFile::~PartFile() {
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

Expected<PartFile> PartFile::create(const std::filesystem::path& final_path) {
  std::string temporary = (final_path.parent_path() / ".volsmooth-XXXXXX").string();
  Descriptor descriptor(mkostemp(temporary.data(), O_CLOEXEC));
  const int error = errno;
  if (!descriptor) temporary.clear();
  PartFile file(final_path, std::move(temporary), std::move(descriptor));
  if (!file.descriptor_) return tl::unexpected(file.cannot_write(error));
  fchmod(file.descriptor_.get(), 0666 & ~current_umask());
  return file;
}

Expected<void> PartFile::write(std::string_view bytes) {
  EVP_DigestUpdate(static_cast<EVP_MD_CTX*>(hash_.get()), bytes.data(), bytes.size());
  bytes_ += static_cast<std::int64_t>(bytes.size());
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return tl::unexpected(cannot_write(errno));
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Expected<void> PartFile::finish(std::int64_t bytes, std::string_view sha256) {
  if (close(descriptor_.release()) != 0) return tl::unexpected(cannot_write(errno));
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  EVP_DigestFinal_ex(static_cast<EVP_MD_CTX*>(hash_.get()), digest.data(), &length);
  if (bytes_ != bytes || hex(digest.data(), length) != sha256) {
    return fail(ExitCode::kInternal,
                final_path_.filename().string() +
                    " was damaged on its way (size or SHA-256 differ), so it was not written; try again.");
  }
  return {};
}

Expected<std::filesystem::path> PartFile::publish(bool overwrite) {
  const int failed = overwrite ? rename(temporary_.c_str(), final_path_.c_str())
                               : rename_to_new(temporary_.c_str(), final_path_.c_str());
  if (failed != 0) return tl::unexpected(cannot_write(errno));
  temporary_.clear();
  return final_path_;
}

Failure PartFile::cannot_write(int error) const {
  const std::string why =
      error == EEXIST ? "it exists already; use --force to replace it" : std::strerror(error);
  return {ExitCode::kCannotWrite, final_path_.string() + " cannot be written: " + why + ".", {}};
}

}  // namespace volsmooth
