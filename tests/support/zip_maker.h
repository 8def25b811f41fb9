#pragma once

#include <isa-l/crc.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/nifti_maker.h"

namespace volsmooth::test {

inline ByteVector bytes_of_text(std::string_view text) {
  ByteVector bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

inline std::uint32_t crc_of(const ByteVector& bytes) {
  return crc32_gzip_refl(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

/// Raw deflate: what a gzip member has between its header and its trailer.
inline ByteVector deflated(const ByteVector& bytes) {
  const ByteVector member = gzipped(bytes);
  return {member.begin() + 10, member.end() - 8};
}

/// An extra field of a header.
inline ByteVector extra_field(std::uint16_t id, const ByteVector& content) {
  ByteWriter out(std::endian::little);
  out.append(id);
  out.append(static_cast<std::uint16_t>(content.size()));
  out.append_bytes(content);
  return out.take();
}

/// Numbers as a zip64 field has them.
inline ByteVector zip64_field(const std::vector<std::uint64_t>& numbers) {
  ByteWriter out(std::endian::little);
  for (const std::uint64_t number : numbers) out.append(number);
  return extra_field(1, out.take());
}

/// One header of an entry; a test changes what it wants to be wrong.
struct ZipHeaderFields {
  std::string name;
  std::uint16_t flags = 0, method = 0;
  std::uint32_t crc = 0, packed_size = 0, size = 0;
  ByteVector extra = {};
};

/// A file in an archive to be.
struct ZipFileEntry {
  ZipHeaderFields local, record;
  ByteVector packed;
  ByteVector behind = {};  ///< a data descriptor
  std::uint32_t attributes = 0100644U << 16;
  std::uint16_t disk = 0;
  std::optional<std::uint32_t> offset = {};  ///< if not where it lies

  ZipFileEntry(const std::string& name, const ByteVector& content, bool deflate = true)
      : packed(deflate ? deflated(content) : content) {
    record = {.name = name,
              .method = static_cast<std::uint16_t>(deflate ? 8 : 0),
              .crc = crc_of(content),
              .packed_size = static_cast<std::uint32_t>(packed.size()),
              .size = static_cast<std::uint32_t>(content.size())};
    local = record;
  }

  /// Changes the local header and the directory's record alike.
  template <class Change>
  ZipFileEntry& both(const Change& change) {
    change(local);
    change(record);
    return *this;
  }

  /// As a writer that cannot seek makes it: the numbers behind the data.
  ZipFileEntry& streamed(bool with_signature, bool wide) {
    both([](ZipHeaderFields& header) { header.flags |= 8; });
    local.crc = local.packed_size = local.size = 0;
    ByteWriter out(std::endian::little);
    if (with_signature) out.append(0x08074b50U);
    out.append(record.crc);
    for (const std::uint32_t size : {record.packed_size, record.size})
      wide ? out.append(std::uint64_t{size}) : out.append(size);
    behind = out.take();
    return *this;
  }
};

/// An archive to be.
struct ZipFile {
  std::vector<ZipFileEntry> entries;
  ByteVector before = {}, between = {}, comment = {}, after = {};
  bool offsets_count_before =
      true;  ///< whether offsets are those in the file, or of the archive without `before`
  std::uint16_t disk = 0;
  std::optional<std::uint16_t> entry_count = {};
  /// Turns true end numbers {entries, directory size, directory offset} into a zip64 end record's.
  std::function<std::array<std::uint64_t, 3>(std::array<std::uint64_t, 3>)> zip64 = {};
};

inline void append_header(ByteWriter& out, const ZipHeaderFields& header) {
  out.append(header.flags);
  out.append(header.method);
  out.append(std::uint32_t{0x21 << 16});  // time, date
  for (const std::uint32_t number : {header.crc, header.packed_size, header.size}) out.append(number);
  out.append(static_cast<std::uint16_t>(header.name.size()));
  out.append(static_cast<std::uint16_t>(header.extra.size()));
}

inline ByteVector bytes_of(const ZipFile& zip) {
  ByteWriter out(std::endian::little);
  out.append_bytes(zip.before);
  const std::size_t start = zip.offsets_count_before ? 0 : zip.before.size();
  std::vector<std::uint32_t> offsets;
  for (const ZipFileEntry& entry : zip.entries) {
    offsets.push_back(static_cast<std::uint32_t>(out.size() - start));
    out.append(0x04034b50U);
    out.append(std::uint16_t{20});
    append_header(out, entry.local);
    out.append_bytes(bytes_of_text(entry.local.name));
    out.append_bytes(entry.local.extra);
    out.append_bytes(entry.packed);
    out.append_bytes(entry.behind);
  }
  out.append_bytes(zip.between);
  const std::size_t directory = out.size();
  for (std::size_t i = 0; i < zip.entries.size(); ++i) {
    const ZipFileEntry& entry = zip.entries[i];
    out.append(0x02014b50U);
    out.append(std::uint32_t{20 << 16 | 3 << 8 | 20});
    append_header(out, entry.record);
    out.append(std::uint16_t{0});
    out.append(entry.disk);
    out.append(std::uint16_t{0});
    out.append(entry.attributes);
    out.append(entry.offset.value_or(offsets[i]));
    out.append_bytes(bytes_of_text(entry.record.name));
    out.append_bytes(entry.record.extra);
  }
  const std::size_t end = out.size();
  if (zip.zip64) {
    const auto numbers = zip.zip64({zip.entries.size(), end - directory, directory - start});
    out.append(0x06064b50U);
    out.append(std::uint64_t{44});
    out.append(std::uint32_t{45 << 16 | 45});
    out.append(std::uint64_t{0});
    for (const std::uint64_t number : {numbers[0], numbers[0], numbers[1], numbers[2]}) out.append(number);
    out.append(0x07064b50U);
    out.append(std::uint32_t{0});
    out.append(static_cast<std::uint64_t>(end - start));
    out.append(std::uint32_t{1});
  }
  out.append(0x06054b50U);
  out.append(zip.disk);
  out.append(zip.disk);
  const auto count =
      zip.entry_count.value_or(static_cast<std::uint16_t>(zip.zip64 ? 0xffffU : zip.entries.size()));
  out.append(count);
  out.append(count);
  out.append(static_cast<std::uint32_t>(zip.zip64 ? 0xffffffffU : end - directory));
  out.append(static_cast<std::uint32_t>(zip.zip64 ? 0xffffffffU : directory - start));
  out.append(static_cast<std::uint16_t>(zip.comment.size()));
  out.append_bytes(zip.comment);
  out.append_bytes(zip.after);
  return out.take();
}

}  // namespace volsmooth::test
