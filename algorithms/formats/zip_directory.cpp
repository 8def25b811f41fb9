#include "algorithms/formats/zip_directory.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>

#include "algorithms/formats/zip_name.h"
#include "algorithms/formats/zip_records.h"

namespace volsmooth {
namespace {

using MaybeRefusal = std::optional<Refusal>;

constexpr std::uint16_t kEncryptionFlags = kZipEncrypted | kZipStrongEncryption | kZipMaskedHeaders;
/// A local header and the directory's record must have these in common.
constexpr std::uint16_t kBindingFlags = kEncryptionFlags | kZipDataDescriptor;
constexpr std::uint64_t kDeflateAtMost = 1032;  ///< bytes out of one byte in
constexpr std::uint32_t kFileType = 0170000, kRegularFile = 0100000, kFolder = 0040000;

Refusal corrupt(const std::string& what) {
  return {"zip-corrupt", "The zip archive is damaged: " + what + "."};
}

bool is_folder(const ZipHeader& entry) {
  return entry.name.ends_with('/');
}

/// What the directory says of one entry must be possible and wanted.
MaybeRefusal check_entry(const ZipHeader& entry, std::size_t file_size) {
  if (!is_safe_name(entry.name))
    return Refusal{"zip-unsafe-name",
                   "A name in the zip archive is absolute, leaves its folder, is not UTF-8, is too long or "
                   "holds control characters. Names must be relative, with forward slashes."};
  const std::uint32_t type = entry.mode & kFileType;
  if (entry.links_another || (type != 0 && type != (is_folder(entry) ? kFolder : kRegularFile)))
    return Refusal{"zip-unsafe-entry",
                   "The zip archive holds a link, a device or the like; pack files only."};
  if ((entry.flags & kEncryptionFlags) != 0)
    return Refusal{"zip-encrypted", "The zip archive is encrypted. Pack it without a password."};
  if (entry.method != kZipStored && entry.method != kZipDeflated)
    return Refusal{"zip-unsupported-method", "The zip archive uses compression method " +
                                                 std::to_string(entry.method) +
                                                 ". Methods 0 (stored) and 8 (deflate) are read."};
  if (is_folder(entry) && entry.size != 0) return corrupt("a folder has content");
  if (entry.packed_size > file_size) return corrupt("an entry is larger than the archive");
  const bool stored = entry.method == kZipStored;
  if (stored ? entry.size != entry.packed_size : entry.size / kDeflateAtMost > entry.packed_size)
    return corrupt("an entry's sizes cannot both be right");
  return std::nullopt;
}

MaybeRefusal check_names(const std::vector<ZipHeader>& records) {
  std::set<std::string> seen;
  for (const ZipHeader& record : records)
    if (!seen.insert(folded_name(record.name)).second)
      return Refusal{"zip-duplicate-entry",
                     "Two names in the zip archive are the same or differ in upper and lower case only."};
  return std::nullopt;
}

/// No size is more than 1032 times the file's, so that adding them up cannot overflow.
MaybeRefusal check_total(const std::vector<ZipHeader>& records, std::size_t file_size,
                         const ZipLimits& limits) {
  std::uint64_t total = 0;
  for (const ZipHeader& record : records) {
    total += record.size;
    if (total > static_cast<std::uint64_t>(limits.max_unpacked_bytes))
      return Refusal{"decompression-limit", "The zip archive unpacks to more than " +
                                                std::to_string(limits.max_unpacked_bytes) + " bytes."};
  }
  if (total > static_cast<std::uint64_t>(limits.free_unpacked_bytes) &&
      static_cast<double>(total) > limits.max_inflate_ratio * static_cast<double>(file_size))
    return Refusal{"decompression-limit", "The zip archive unpacks to more than " +
                                              std::to_string(std::llround(limits.max_inflate_ratio)) +
                                              " times its size."};
  return std::nullopt;
}

/// A writer that could not seek leaves 0 where the data descriptor has the number.
bool repeats(const ZipHeader& local, const ZipHeader& record) {
  const bool later = (record.flags & kZipDataDescriptor) != 0;
  const auto same = [later](auto here, auto there) { return here == there || (later && here == 0); };
  return local.name == record.name && local.method == record.method &&
         (local.flags & kBindingFlags) == (record.flags & kBindingFlags) && same(local.crc, record.crc) &&
         same(local.size, record.size) && same(local.packed_size, record.packed_size);
}

/// Reads a zip archive's directory and holds the entries' own headers to it.
class DirectoryReader {
 public:
  DirectoryReader(std::span<const std::byte> file, const ZipLimits& limits) : file_(file), limits_(limits) {}

  tl::expected<std::vector<ZipEntry>, Refusal> read() {
    MaybeRefusal refusal = read_records();
    if (!refusal) refusal = check_names(records_);
    if (!refusal) refusal = check_total(records_, file_.size(), limits_);
    if (!refusal) refusal = read_local_headers();
    if (refusal) return tl::unexpected(*std::move(refusal));
    return files();
  }

 private:
  MaybeRefusal read_records() {
    const auto end = zip_end(file_);
    if (!end)
      return corrupt(
          "its end record is missing, doubled, or does not fit; or something was put before or "
          "behind the archive");
    if (end->entries > static_cast<std::uint64_t>(limits_.max_entries))
      return Refusal{"zip-too-many-entries",
                     "The zip archive has more than " + std::to_string(limits_.max_entries) + " entries."};
    directory_offset_ = end->directory_offset;
    auto directory = file_.subspan(end->directory_offset, end->directory_size);
    for (std::uint64_t i = 0; i < end->entries; ++i) {
      auto record = directory_record(directory);
      if (!record) return corrupt("its directory is cut short or contradicts itself");
      directory = directory.subspan(record->length_in_file);
      if (auto refusal = check_entry(*record, file_.size())) return refusal;
      records_.push_back(*std::move(record));
    }
    if (!directory.empty()) return corrupt("its directory is longer than its entries");
    return std::nullopt;
  }

  /// Entry for entry in the order of the file: they must fill it up to the directory.
  MaybeRefusal read_local_headers() {
    std::vector<std::size_t> order(records_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [this](std::size_t i) { return records_[i].header_offset; });
    const auto begin_of = [&](std::size_t k) {
      return k < order.size() ? records_[order[k]].header_offset : directory_offset_;
    };
    if (begin_of(0) != 0) return corrupt("it does not begin with an entry");
    data_offsets_.resize(records_.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      if (begin_of(k + 1) > directory_offset_) return corrupt("an entry lies outside of it");
      if (auto refusal = read_local_header(order[k], begin_of(k + 1))) return refusal;
    }
    return std::nullopt;
  }

  /// The entry must fill the bytes up to `next`.
  MaybeRefusal read_local_header(std::size_t which, std::uint64_t next) {
    const ZipHeader& record = records_[which];
    const auto local =
        local_header(file_.subspan(record.header_offset, directory_offset_ - record.header_offset));
    if (!local) return corrupt("an entry's own header is missing or contradicts itself");
    const std::uint64_t data = record.header_offset + local->length_in_file;
    const std::uint64_t end = data + record.packed_size;  // both are at most the file's size
    if (end > directory_offset_) return corrupt("an entry's data is cut short");
    if (end > next) return Refusal{"zip-overlap", "Entries of the zip archive overlap one another."};
    if (!repeats(*local, record)) return corrupt("an entry's own header is not what the directory says");
    if (!is_data_descriptor_of(record, file_.subspan(end, next - end)))
      return corrupt("what follows an entry's data does not belong to it");
    data_offsets_[which] = data;
    return std::nullopt;
  }

  std::vector<ZipEntry> files() const {
    std::vector<ZipEntry> entries;
    for (std::size_t i = 0; i < records_.size(); ++i) {
      const ZipHeader& record = records_[i];
      if (is_folder(record)) continue;
      entries.push_back({record.name, data_offsets_[i], record.packed_size, record.size, record.crc,
                         record.method == kZipDeflated});
    }
    return entries;
  }

  std::span<const std::byte> file_;
  const ZipLimits& limits_;
  std::uint64_t directory_offset_ = 0;
  std::vector<ZipHeader> records_;
  std::vector<std::uint64_t> data_offsets_;
};

}  // namespace

bool looks_like_zip(std::span<const std::byte> head) {
  // An archive without entries begins with its end record.
  const auto begins_with = [head](std::byte third, std::byte fourth) {
    return head.size() >= 4 && head[0] == std::byte{'P'} && head[1] == std::byte{'K'} && head[2] == third &&
           head[3] == fourth;
  };
  return begins_with(std::byte{3}, std::byte{4}) || begins_with(std::byte{5}, std::byte{6});
}

tl::expected<std::vector<ZipEntry>, Refusal> read_zip_directory(std::span<const std::byte> file,
                                                                const ZipLimits& limits) {
  return DirectoryReader(file, limits).read();
}

}  // namespace volsmooth
