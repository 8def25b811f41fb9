#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/read_limits.h"
#include "algorithms/formats/refusal.h"
#include "algorithms/formats/zip_directory.h"

namespace volsmooth {

/// One file of an upload; what it was unpacked to lives as long as this does.
struct OpenedFile {
  std::span<const std::byte> bytes;
  std::shared_ptr<const std::vector<std::byte>> unpacked = {};
};

/// The files in an upload. Unpacked ones are kept while they are less than 256 MiB together, or alone.
/// Several threads may open files at once.
class UploadedFiles {
 public:
  /// `upload` must outlive the object. Refusals: those of `read_zip_directory`, `multipart-corrupt`.
  static tl::expected<UploadedFiles, Refusal> in(std::span<const std::byte> upload, const ReadLimits& limits);

  std::size_t count() const { return entries_.size(); }

  /// One file of a multipart body, or the only one, as it lies in the upload; of a zip, the zip.
  std::span<const std::byte> stored(std::size_t which) const { return entries_.at(which).stored; }

  /// One file. A Part 10 file in the deflated transfer syntax comes out inflated, as the explicit little
  /// endian file that it is then. Refusals: those of `unpack`, decompression-limit.
  tl::expected<OpenedFile, Refusal> open(std::size_t which);

  /// How many of the files may be open at once, so that they hold no more than is kept.
  int open_at_once() const;

 private:
  struct Entry {
    std::span<const std::byte> stored = {};
    std::optional<ZipEntry> packed = {};  ///< in `stored`, which is the zip then
    std::optional<OpenedFile> kept = {};
    /// Held while the file is unpacked, lest two threads do.
    std::unique_ptr<std::mutex> unpacking = std::make_unique<std::mutex>();
  };

  void add(std::span<const std::byte> stored, std::optional<ZipEntry> packed = {});
  tl::expected<OpenedFile, Refusal> unpacked(const Entry& entry) const;
  void keep(Entry& entry, const OpenedFile& file);

  std::vector<Entry> entries_;
  ReadLimits limits_;
  std::size_t largest_bytes_ = 1;
  std::size_t kept_bytes_ = 0;  ///< it and what entries keep: guarded by `keeping_`
  std::unique_ptr<std::mutex> keeping_ = std::make_unique<std::mutex>();
};

}  // namespace volsmooth
