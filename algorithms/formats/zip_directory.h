#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/refusal.h"

namespace volsmooth {

/// Limits that hold for a whole archive, checked before anything is unpacked.
struct ZipLimits {
  std::int64_t max_entries = 65'535;
  std::int64_t max_unpacked_bytes = std::int64_t{16} << 30;    ///< of all entries together
  double max_inflate_ratio = 400;                              ///< all unpacked bytes to the file's ...
  std::int64_t free_unpacked_bytes = std::int64_t{256} << 20;  ///< ... once they are more than this
};

/// A file in an archive, as the directory has it and the header before its data repeats it.
struct ZipEntry {
  std::string name;  ///< UTF-8, relative, without ".."
  std::uint64_t data_offset = 0;
  std::uint64_t packed_size = 0;
  std::uint64_t size = 0;
  std::uint32_t crc = 0;
  bool deflated = false;  ///< else stored
};

bool looks_like_zip(std::span<const std::byte> head);

/// The files (not the folders) in a zip archive, in the order of its directory; archives of more than 4 GiB
/// (zip64) and of writers that could not seek (data descriptors) as well. Everything but the data is
/// verified: one archive on one disk, which begins at the first byte and ends with the last; every byte
/// belongs to one entry or to the directory; each entry's own header says what the directory says.
///
/// Refusals: zip-corrupt, zip-overlap, zip-unsafe-name (absolute, "..", backslash, control or direction
/// characters, not UTF-8, too long), zip-unsafe-entry (links, devices), zip-duplicate-entry (also by upper
/// and lower case), zip-encrypted, zip-unsupported-method, zip-too-many-entries, decompression-limit.
tl::expected<std::vector<ZipEntry>, Refusal> read_zip_directory(std::span<const std::byte> file,
                                                                const ZipLimits& limits = {});

}  // namespace volsmooth
