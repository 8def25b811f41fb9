#include "algorithms/formats/zip_records.h"

#include <algorithm>

#include "algorithms/formats/little_endian.h"

namespace volsmooth {
namespace {

constexpr std::uint32_t kLocalSignature = 0x04034b50, kDirectorySignature = 0x02014b50,
                        kEndSignature = 0x06054b50, kZip64EndSignature = 0x06064b50,
                        kZip64LocatorSignature = 0x07064b50, kDescriptorSignature = 0x08074b50;
constexpr std::size_t kEndSize = 22, kZip64EndSize = 56, kZip64LocatorSize = 20, kMostComment = 1024;
constexpr std::uint32_t kIn64 = 0xffffffff;  ///< the number stands in the zip64 field
constexpr std::uint16_t kIn64Short = 0xffff;
constexpr std::uint16_t kZip64Field = 0x0001, kPkwareUnixField = 0x000d, kAsiUnixField = 0x756e;
constexpr std::uint16_t kVersion = 20, kZip64Version = 45, kMadeByUnix = 3 << 8;
constexpr std::uint16_t kNoTime = 0, kNoDate = 1 << 5 | 1;  ///< 1980-01-01, the earliest there is

using Numbers64 = std::vector<std::uint64_t*>;

/// The 32-bit numbers of the record that stand in the zip64 field instead, in its order.
void want_if_in_64(std::uint64_t& number, Numbers64& wanted) {
  if (number == kIn64) wanted.push_back(&number);
}

/// PKWARE's Unix field ends with the link's target; ASi's has the target's length behind checksum and mode.
bool is_link_field(std::uint16_t id, std::span<const std::byte> field) {
  constexpr std::size_t kTimesAndOwner = 12;
  if (id == kPkwareUnixField) return field.size() > kTimesAndOwner;
  if (id != kAsiUnixField) return false;
  LittleEndianReader in(field);
  in.skip(6);
  return in.number<std::uint32_t>() != 0;
}

/// False: a field runs over the end, or numbers are missing. Fewer bytes than a field's head are padding.
bool read_extra_fields(std::span<const std::byte> bytes, ZipHeader& header, const Numbers64& wanted) {
  bool found_all = wanted.empty();
  for (LittleEndianReader in(bytes); in.left() >= 4;) {
    const auto id = in.number<std::uint16_t>();
    const auto field = in.bytes(in.number<std::uint16_t>());
    if (!in.ok()) return false;
    if (is_link_field(id, field)) header.links_another = true;
    if (id != kZip64Field || found_all) continue;
    LittleEndianReader numbers(field);
    for (std::uint64_t* number : wanted) *number = numbers.number<std::uint64_t>();
    if (!numbers.ok()) return false;
    found_all = true;
  }
  return found_all;
}

struct EndRecord {
  ZipEnd end;
  bool needs_zip64 = false;
};

std::optional<EndRecord> plain_end(std::span<const std::byte> bytes) {
  LittleEndianReader in(bytes);
  const auto signature = in.number<std::uint32_t>();
  const auto disk = in.number<std::uint16_t>(), directory_disk = in.number<std::uint16_t>();
  const auto entries_here = in.number<std::uint16_t>(), entries = in.number<std::uint16_t>();
  const auto size = in.number<std::uint32_t>(), offset = in.number<std::uint32_t>();
  const auto comment = in.number<std::uint16_t>();
  if (!in.ok() || signature != kEndSignature || in.left() != comment) return std::nullopt;
  const auto first_disk = [](std::uint16_t number) { return number == 0 || number == kIn64Short; };
  if (!first_disk(disk) || !first_disk(directory_disk) || entries_here != entries) return std::nullopt;
  const bool needs_zip64 = disk == kIn64Short || directory_disk == kIn64Short || entries == kIn64Short ||
                           size == kIn64 || offset == kIn64;
  return EndRecord{{entries, offset, size}, needs_zip64};
}

/// Where the only end record that reaches to the end of the file begins.
std::optional<std::size_t> end_position(std::span<const std::byte> file) {
  std::optional<std::size_t> found;
  for (std::size_t comment = 0; comment <= kMostComment && comment + kEndSize <= file.size(); ++comment) {
    const std::size_t at = file.size() - kEndSize - comment;
    LittleEndianReader in(file.subspan(at));
    if (in.number<std::uint32_t>() != kEndSignature) continue;
    in.skip(16);
    if (in.number<std::uint16_t>() != comment) continue;
    if (found) return std::nullopt;
    found = at;
  }
  return found;
}

/// The zip64 end record at `at` and the locator behind it, which must point to it.
std::optional<ZipEnd> zip64_end(std::span<const std::byte> file, std::uint64_t at) {
  if (at > file.size() || file.size() - at < kZip64EndSize + kZip64LocatorSize) return std::nullopt;
  LittleEndianReader in(file.subspan(at));
  const auto signature = in.number<std::uint32_t>();
  const auto size = in.number<std::uint64_t>();
  in.skip(4);  // versions
  const auto disks = in.number<std::uint64_t>();
  const auto entries_here = in.number<std::uint64_t>();
  ZipEnd end;
  end.entries = in.number<std::uint64_t>();
  end.directory_size = in.number<std::uint64_t>();
  end.directory_offset = in.number<std::uint64_t>();
  const auto locator = in.number<std::uint32_t>();
  const auto end_disk = in.number<std::uint32_t>();
  const auto end_offset = in.number<std::uint64_t>();
  const auto disk_count = in.number<std::uint32_t>();
  const bool good = signature == kZip64EndSignature && size == kZip64EndSize - 12 && disks == 0 &&
                    entries_here == end.entries && locator == kZip64LocatorSignature && end_disk == 0 &&
                    end_offset == at && disk_count <= 1;
  return good ? std::optional(end) : std::nullopt;
}

bool agrees(const ZipEnd& plain, const ZipEnd& full) {
  return (plain.entries == kIn64Short || plain.entries == full.entries) &&
         (plain.directory_size == kIn64 || plain.directory_size == full.directory_size) &&
         (plain.directory_offset == kIn64 || plain.directory_offset == full.directory_offset);
}

/// Whether the directory lies in the file and ends at `position`. The sum cannot overflow.
bool ends_at(const ZipEnd& end, std::uint64_t position) {
  return end.directory_offset <= position && end.directory_size == position - end.directory_offset;
}

bool needs_zip64(const ZipHeader& entry) {
  return entry.header_offset >= kIn64;
}

/// What an entry's own header and its record in the directory both have, in this order.
void read_shared_fields(LittleEndianReader& in, ZipHeader& header) {
  header.flags = in.number<std::uint16_t>();
  header.method = in.number<std::uint16_t>();
  in.skip(4);  // time and date
  header.crc = in.number<std::uint32_t>();
  header.packed_size = in.number<std::uint32_t>();
  header.size = in.number<std::uint32_t>();
}

}  // namespace

std::optional<ZipHeader> local_header(std::span<const std::byte> bytes) {
  LittleEndianReader in(bytes);
  ZipHeader header;
  if (in.number<std::uint32_t>() != kLocalSignature) return std::nullopt;
  in.skip(2);  // version
  read_shared_fields(in, header);
  const auto name_length = in.number<std::uint16_t>(), extra_length = in.number<std::uint16_t>();
  header.name = in.text(name_length);
  const auto extra = in.bytes(extra_length);
  Numbers64 wanted;
  want_if_in_64(header.size, wanted);
  want_if_in_64(header.packed_size, wanted);
  if (!in.ok() || !read_extra_fields(extra, header, wanted)) return std::nullopt;
  header.length_in_file = bytes.size() - in.left();
  return header;
}

std::optional<ZipHeader> directory_record(std::span<const std::byte> bytes) {
  LittleEndianReader in(bytes);
  ZipHeader header;
  if (in.number<std::uint32_t>() != kDirectorySignature) return std::nullopt;
  in.skip(4);  // versions
  read_shared_fields(in, header);
  const auto name_length = in.number<std::uint16_t>(), extra_length = in.number<std::uint16_t>(),
             comment_length = in.number<std::uint16_t>();
  const auto disk = in.number<std::uint16_t>();
  in.skip(2);  // internal attributes
  header.mode = in.number<std::uint32_t>() >> 16;
  header.header_offset = in.number<std::uint32_t>();
  header.name = in.text(name_length);
  const auto extra = in.bytes(extra_length);
  in.skip(comment_length);
  Numbers64 wanted;
  want_if_in_64(header.size, wanted);
  want_if_in_64(header.packed_size, wanted);
  want_if_in_64(header.header_offset, wanted);
  if (!in.ok() || disk != 0 || !read_extra_fields(extra, header, wanted)) return std::nullopt;
  header.length_in_file = bytes.size() - in.left();
  return header;
}

std::optional<ZipEnd> zip_end(std::span<const std::byte> file) {
  const auto position = end_position(file);
  if (!position) return std::nullopt;
  const auto record = plain_end(file.subspan(*position));
  if (!record) return std::nullopt;
  if (!record->needs_zip64 && ends_at(record->end, *position)) return record->end;
  if (*position < kZip64EndSize + kZip64LocatorSize) return std::nullopt;
  const std::uint64_t zip64_position = *position - kZip64EndSize - kZip64LocatorSize;
  const auto full = zip64_end(file, zip64_position);
  if (!full || !agrees(record->end, *full) || !ends_at(*full, zip64_position)) return std::nullopt;
  return full;
}

bool is_data_descriptor_of(const ZipHeader& entry, std::span<const std::byte> bytes) {
  if ((entry.flags & kZipDataDescriptor) == 0) return bytes.empty();
  const bool has_signature = bytes.size() == 16 || bytes.size() == 24;
  const bool wide = bytes.size() >= 20;
  LittleEndianReader in(bytes);
  if (has_signature && in.number<std::uint32_t>() != kDescriptorSignature) return false;
  const auto number = [&] { return wide ? in.number<std::uint64_t>() : in.number<std::uint32_t>(); };
  const bool good =
      in.number<std::uint32_t>() == entry.crc && number() == entry.packed_size && number() == entry.size;
  return good && in.ok() && in.left() == 0;
}

std::vector<std::byte> local_header_bytes(const ZipHeader& entry) {
  LittleEndianWriter out;
  out.number(kLocalSignature);
  out.number(kVersion);
  out.number(entry.flags);
  out.number(entry.method);
  out.number(kNoTime);
  out.number(kNoDate);
  out.number(entry.crc);
  out.number(static_cast<std::uint32_t>(entry.packed_size));
  out.number(static_cast<std::uint32_t>(entry.size));
  out.number(static_cast<std::uint16_t>(entry.name.size()));
  out.number(std::uint16_t{0});  // no extra field
  out.text(entry.name);
  return out.take();
}

std::vector<std::byte> directory_record_bytes(const ZipHeader& entry) {
  const bool far = needs_zip64(entry);
  LittleEndianWriter out;
  out.number(kDirectorySignature);
  out.number(static_cast<std::uint16_t>(kMadeByUnix | kZip64Version));
  out.number(far ? kZip64Version : kVersion);
  out.number(entry.flags);
  out.number(entry.method);
  out.number(kNoTime);
  out.number(kNoDate);
  out.number(entry.crc);
  out.number(static_cast<std::uint32_t>(entry.packed_size));
  out.number(static_cast<std::uint32_t>(entry.size));
  out.number(static_cast<std::uint16_t>(entry.name.size()));
  out.number(static_cast<std::uint16_t>(far ? 12 : 0));
  out.number(std::uint16_t{0});  // no comment
  out.number(std::uint16_t{0});  // first disk
  out.number(std::uint16_t{0});  // internal attributes
  out.number(entry.mode << 16);
  out.number(far ? kIn64 : static_cast<std::uint32_t>(entry.header_offset));
  out.text(entry.name);
  if (far) {
    out.number(kZip64Field);
    out.number(std::uint16_t{8});
    out.number(entry.header_offset);
  }
  return out.take();
}

std::vector<std::byte> zip_end_bytes(const ZipEnd& end) {
  const bool large =
      end.entries >= kIn64Short || end.directory_offset >= kIn64 || end.directory_size >= kIn64;
  LittleEndianWriter out;
  if (large) {
    out.number(kZip64EndSignature);
    out.number(std::uint64_t{kZip64EndSize - 12});
    out.number(static_cast<std::uint16_t>(kMadeByUnix | kZip64Version));
    out.number(kZip64Version);
    out.number(std::uint64_t{0});  // first disk, twice
    out.number(end.entries);
    out.number(end.entries);
    out.number(end.directory_size);
    out.number(end.directory_offset);
    out.number(kZip64LocatorSignature);
    out.number(std::uint32_t{0});
    out.number(end.directory_offset + end.directory_size);
    out.number(std::uint32_t{1});
  }
  const auto entries = large ? kIn64Short : static_cast<std::uint16_t>(end.entries);
  out.number(kEndSignature);
  out.number(std::uint32_t{0});  // first disk, twice
  out.number(entries);
  out.number(entries);
  out.number(large ? kIn64 : static_cast<std::uint32_t>(end.directory_size));
  out.number(large ? kIn64 : static_cast<std::uint32_t>(end.directory_offset));
  out.number(std::uint16_t{0});
  return out.take();
}

}  // namespace volsmooth
