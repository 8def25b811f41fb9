#include "client/packed_folder.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string_view>
#include <vector>

namespace volsmooth {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

tl::unexpected<Failure> no_input(const fs::path& path, const char* why) {
  return fail(ExitCode::kNoInput, path.string() + " cannot be read: " + why + ".");
}

Expected<std::vector<fs::path>> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_regular_file(ignored)) files.push_back(entry->path());
  }
  if (error) return no_input(folder, error.message().c_str());
  if (files.empty()) return fail(ExitCode::kNoInput, folder.string() + " holds no files.");
  std::ranges::sort(files);
  return files;
}

/// No name, so that nothing is left of patients' data whatever happens.
Descriptor nameless_file() {
  const char* chosen = std::getenv("TMPDIR");
  for (const fs::path& place : {fs::path(chosen != nullptr ? chosen : ""), fs::path("/tmp")}) {
    if (!place.is_absolute()) continue;
    Descriptor file(open(place.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
    if (file) return file;
    std::string name =
        (place / "volsmooth-XXXXXX").string();  // file systems that have no files without names
    file = Descriptor(mkostemp(name.data(), O_CLOEXEC));
    if (!file) continue;
    unlink(name.c_str());
    return file;
  }
  return Descriptor();
}

/// 128 random bits: no file holds them by chance.
std::string random_boundary() {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::random_device random;
  std::string boundary = "volsmooth-";
  for (int digit = 0; digit < 32; ++digit) boundary += kDigits[random() % kDigits.size()];
  return boundary;
}

Expected<void> append(const Descriptor& body, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(body.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0)
      return fail(ExitCode::kCannotWrite, "The folder cannot be packed in $TMPDIR or /tmp: " +
                                              std::string(std::strerror(errno)) + ".");
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Expected<void> append_file(const Descriptor& body, const fs::path& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) return no_input(path, std::strerror(errno));
  std::string block(kBlockBytes, '\0');
  for (;;) {
    const ssize_t got = read(file.get(), block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return no_input(path, std::strerror(errno));
    if (got == 0) return {};
    if (auto done = append(body, std::string_view(block).substr(0, static_cast<std::size_t>(got))); !done)
      return done;
  }
}

}  // namespace

Expected<PackedFolder> pack_folder(const fs::path& folder) {
  const auto files = files_in(folder);
  if (!files) return tl::unexpected(files.error());
  const std::string boundary = random_boundary();
  PackedFolder packed{.body = nameless_file(),
                      .content_type = "multipart/related; type=\"application/dicom\"; boundary=" + boundary};
  if (!packed.body) {
    return fail(ExitCode::kCannotWrite, "No file for the packed folder can be made in $TMPDIR or /tmp: " +
                                            std::string(std::strerror(errno)) + ".");
  }
  Expected<void> done;
  for (const fs::path& file : *files) {
    if (done) done = append(packed.body, "--" + boundary + "\r\nContent-Type: application/dicom\r\n\r\n");
    if (done) done = append_file(packed.body, file);
    if (done) done = append(packed.body, "\r\n");
  }
  if (done) done = append(packed.body, "--" + boundary + "--\r\n");
  if (!done) return tl::unexpected(done.error());
  packed.bytes = lseek(packed.body.get(), 0, SEEK_CUR);
  lseek(packed.body.get(), 0, SEEK_SET);
  return packed;
}

}  // namespace volsmooth
