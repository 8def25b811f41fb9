#pragma once

// The records of a zip archive (PKWARE's APPNOTE.TXT 6.3, section 4.3), as they stand in the file.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace volsmooth {

constexpr std::uint16_t kZipEncrypted = 1, kZipDataDescriptor = 1 << 3, kZipStrongEncryption = 1 << 6,
                        kZipUtf8Names = 1 << 11, kZipMaskedHeaders = 1 << 13;
constexpr std::uint16_t kZipStored = 0, kZipDeflated = 8;

/// A header before an entry's data, or the directory's record of it.
struct ZipHeader {
  std::uint16_t flags = 0, method = 0;
  std::uint32_t crc = 0;
  std::uint64_t packed_size = 0, size = 0;
  std::string name;
  // Of the directory alone.
  std::uint32_t mode = 0;  ///< as in Unix' st_mode; 0 where the writer knows none
  std::uint64_t header_offset = 0;

  bool links_another = false;        ///< an extra field names the file that this is a link to
  std::uint64_t length_in_file = 0;  ///< of the record
};

/// Where the directory lies.
struct ZipEnd {
  std::uint64_t entries = 0, directory_offset = 0, directory_size = 0;
};

// Each takes the record at the front of `bytes`. Nothing: it is not there whole, or contradicts itself.
std::optional<ZipHeader> local_header(std::span<const std::byte> bytes);
std::optional<ZipHeader> directory_record(std::span<const std::byte> bytes);

/// What ends the archive: nothing unless exactly one end record ends with the file, with at most 1,024 bytes
/// of comment, and lies directly behind the directory (or behind the zip64 end record that lies there).
std::optional<ZipEnd> zip_end(std::span<const std::byte> file);

/// Whether `bytes`, which lie between an entry's data and the next record, are nothing or the data
/// descriptor of `entry`: with or without signature, with sizes of 4 or 8 bytes.
bool is_data_descriptor_of(const ZipHeader& entry, std::span<const std::byte> bytes);

std::vector<std::byte> local_header_bytes(const ZipHeader& entry);
std::vector<std::byte> directory_record_bytes(const ZipHeader& entry);
std::vector<std::byte> zip_end_bytes(const ZipEnd& end);

}  // namespace volsmooth
