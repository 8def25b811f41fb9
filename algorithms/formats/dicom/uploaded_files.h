#pragma once

#include <cstddef>
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

/// The files in an upload. Unpacked ones are kept while they are less than 256 MiB together, or alone.
class UploadedFiles {
 public:
  /// `upload` must outlive the object. Refusals: those of `read_zip_directory`, `multipart-corrupt`.
  static tl::expected<UploadedFiles, Refusal> in(std::span<const std::byte> upload, const ReadLimits& limits);

  std::size_t count() const { return entries_.size(); }

  /// One file of a multipart body, or the only one, as it lies in the upload; of a zip, the zip.
  std::span<const std::byte> stored(std::size_t which) const { return entries_.at(which).stored; }

  /// The bytes of one file, valid until the next call for another. A Part 10 file in the deflated transfer
  /// syntax comes out inflated, as the explicit little endian file that it is then. Refusals: those of
  /// `unpack`, decompression-limit.
  tl::expected<std::span<const std::byte>, Refusal> bytes(std::size_t which);

 private:
  struct Entry {
    std::span<const std::byte> stored = {};
    std::optional<ZipEntry> packed = {};     ///< in `stored`, which is the zip then
    std::vector<std::byte> unpacked = {};    ///< while it is kept
    std::span<const std::byte> opened = {};  ///< empty: not yet, or not kept
  };

  void keep(std::size_t which, std::vector<std::byte> unpacked);

  std::vector<Entry> entries_;
  ReadLimits limits_;
  std::size_t kept_bytes_ = 0;
};

}  // namespace volsmooth
