#include "algorithms/formats/gzip_writer.h"

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <vector>

#include "algorithms/formats/buffered_file.h"
#include "algorithms/formats/isal.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::size_t kBlocksAtOnce = 16;
constexpr std::array<unsigned char, 10> kHeader{0x1f, 0x8b, 8, 0, 0,
                                                0,    0,    0, 0, 0xff};  // no time, any system
constexpr std::array<unsigned char, 2> kEmptyLastBlock{0x03, 0x00};

/// Deflates blocks that end on a byte and do not look back at one another, so that they can be joined.
class BlockDeflater {
 public:
  BlockDeflater() : stream_(std::make_unique<isal_zstream>()), level_buffer_(ISAL_DEF_LVL1_DEFAULT) {}

  void deflate(std::span<std::byte> block, std::vector<std::byte>& out) {
    // Deflate grows by at most 5 bytes per stored block of at most 65535, and the flush marker.
    out.resize(block.size() + block.size() / 1000 + 1024);
    isal_deflate_init(stream_.get());
    stream_->level = 1;
    stream_->level_buf = level_buffer_.data();
    stream_->level_buf_size = static_cast<std::uint32_t>(level_buffer_.size());
    stream_->flush = FULL_FLUSH;
    stream_->next_in = reinterpret_cast<std::uint8_t*>(block.data());
    stream_->avail_in = static_cast<std::uint32_t>(block.size());
    stream_->next_out = reinterpret_cast<std::uint8_t*>(out.data());
    stream_->avail_out = static_cast<std::uint32_t>(out.size());
    if (isal::deflate(*stream_) != COMP_OK || stream_->avail_in != 0 || stream_->avail_out == 0) {
      throw std::logic_error("a deflated block is larger than it can be");
    }
    out.resize(stream_->total_out);
  }

 private:
  std::unique_ptr<isal_zstream> stream_;
  std::vector<std::uint8_t> level_buffer_;
};

struct Block {
  std::vector<std::byte> plain, deflated;
  BlockDeflater deflater;
};

}  // namespace

void write_gzip(const std::filesystem::path& path, std::int64_t size, std::int64_t block_bytes,
                const std::function<void(std::int64_t, std::span<std::byte>)>& make, const Progress& report) {
  BufferedFile file(path);
  file.value(kHeader);
  std::uint32_t crc = 0;
  std::array<Block, kBlocksAtOnce> blocks;
  const std::int64_t batch_bytes = block_bytes * static_cast<std::int64_t>(kBlocksAtOnce);
  for (std::int64_t begin = 0; begin < size; begin += batch_bytes) {
    const std::int64_t end = std::min(size, begin + batch_bytes);
    parallel_for(end - begin, block_bytes, [&](std::int64_t from, std::int64_t to) {
      Block& block = blocks[static_cast<std::size_t>(from / block_bytes)];
      block.plain.resize(static_cast<std::size_t>(to - from));
      make(begin + from, block.plain);
      block.deflater.deflate(block.plain, block.deflated);
    });
    const auto filled = static_cast<std::size_t>((end - begin + block_bytes - 1) / block_bytes);
    for (const Block& block : std::span(blocks).first(filled)) {
      crc = isal::crc32(crc, block.plain);
      file.bytes(block.deflated.data(), block.deflated.size());
    }
    report(static_cast<double>(end) / static_cast<double>(size));
  }
  file.value(kEmptyLastBlock);
  file.value(crc);
  file.value(static_cast<std::uint32_t>(size));  // RFC 1952: modulo 2^32
  file.close();
}

}  // namespace volsmooth
