#include "algorithms/formats/zip_writer.h"

#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>

#include <limits>
#include <stdexcept>

#include "algorithms/formats/zip_records.h"

namespace volsmooth {
namespace {

constexpr std::uint32_t kFileMode = 0100644;

}  // namespace

ZipWriter::ZipWriter(Sink sink) : sink_(std::move(sink)), level_buffer_(ISAL_DEF_LVL1_DEFAULT) {}

void ZipWriter::add(const std::string& name, std::span<const std::byte> content) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max() / 1001 * 1000 - 1024;
  if (content.size() > kMost) throw std::logic_error("a file of 4 GiB for an archive");
  const auto packed = deflated(content);
  ZipHeader entry;
  entry.name = name;
  entry.flags = kZipUtf8Names;
  entry.method = kZipDeflated;
  entry.crc = crc32_gzip_refl(0, reinterpret_cast<const unsigned char*>(content.data()), content.size());
  entry.packed_size = packed.size();
  entry.size = content.size();
  entry.mode = kFileMode;
  entry.header_offset = written_;
  put(local_header_bytes(entry));
  put(packed);
  const auto record = directory_record_bytes(entry);
  directory_.insert(directory_.end(), record.begin(), record.end());
  ++entries_;
}

void ZipWriter::finish() {
  const ZipEnd end{entries_, written_, directory_.size()};
  put(directory_);
  put(zip_end_bytes(end));
}

std::vector<std::byte> ZipWriter::deflated(std::span<const std::byte> content) {
  // Deflate grows by at most 5 bytes per stored block of at most 65535.
  std::vector<std::byte> out(content.size() + content.size() / 1000 + 1024);
  isal_zstream stream;
  isal_deflate_stateless_init(&stream);
  stream.level = 1;
  stream.level_buf = level_buffer_.data();
  stream.level_buf_size = static_cast<std::uint32_t>(level_buffer_.size());
  stream.end_of_stream = 1;
  stream.next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(content.data()));
  stream.avail_in = static_cast<std::uint32_t>(content.size());
  stream.next_out = reinterpret_cast<std::uint8_t*>(out.data());
  stream.avail_out = static_cast<std::uint32_t>(out.size());
  if (isal_deflate_stateless(&stream) != COMP_OK || stream.avail_in != 0)
    throw std::logic_error("a deflated file is larger than it can be");
  out.resize(stream.total_out);
  return out;
}

void ZipWriter::put(std::span<const std::byte> bytes) {
  sink_(bytes);
  written_ += bytes.size();
}

}  // namespace volsmooth
