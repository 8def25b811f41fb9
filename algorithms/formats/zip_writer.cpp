#include "algorithms/formats/zip_writer.h"

#include <limits>
#include <memory>
#include <stdexcept>

#include "algorithms/formats/isal.h"
#include "algorithms/formats/zip_records.h"

namespace volsmooth {
namespace {

constexpr std::uint32_t kFileMode = 0100644;

std::vector<std::byte> deflated(std::span<const std::byte> content) {
  // Deflate grows by at most 5 bytes per stored block of at most 65535.
  std::vector<std::byte> out(content.size() + content.size() / 1000 + 1024);
  const auto level_buffer = std::make_unique_for_overwrite<std::uint8_t[]>(ISAL_DEF_LVL1_DEFAULT);
  isal_zstream stream;
  isal_deflate_stateless_init(&stream);
  stream.hist_bits = 0;  // which it leaves as it was
  stream.level = 1;
  stream.level_buf = level_buffer.get();
  stream.level_buf_size = ISAL_DEF_LVL1_DEFAULT;
  stream.end_of_stream = 1;
  stream.next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(content.data()));
  stream.avail_in = static_cast<std::uint32_t>(content.size());
  stream.next_out = reinterpret_cast<std::uint8_t*>(out.data());
  stream.avail_out = static_cast<std::uint32_t>(out.size());
  if (isal::deflate_stateless(stream) != COMP_OK || stream.avail_in != 0)
    throw std::logic_error("a deflated file is larger than it can be");
  out.resize(stream.total_out);
  return out;
}

}  // namespace

PackedFile pack(std::span<const std::byte> content) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max() / 1001 * 1000 - 1024;
  if (content.size() > kMost) throw std::logic_error("a file of 4 GiB for an archive");
  return {deflated(content), content.size(), isal::crc32(0, content)};
}

void ZipWriter::add(const std::string& name, const PackedFile& file) {
  ZipHeader entry;
  entry.name = name;
  entry.flags = kZipUtf8Names;
  entry.method = kZipDeflated;
  entry.crc = file.crc;
  entry.packed_size = file.deflated.size();
  entry.size = file.size;
  entry.mode = kFileMode;
  entry.header_offset = written_;
  put(local_header_bytes(entry));
  put(file.deflated);
  const auto record = directory_record_bytes(entry);
  directory_.insert(directory_.end(), record.begin(), record.end());
  ++entries_;
}

void ZipWriter::finish() {
  const ZipEnd end{entries_, written_, directory_.size()};
  put(directory_);
  put(zip_end_bytes(end));
}

void ZipWriter::put(std::span<const std::byte> bytes) {
  sink_(bytes);
  written_ += bytes.size();
}

}  // namespace volsmooth
