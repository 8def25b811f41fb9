#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "algorithms/progress.h"

namespace volsmooth {

/// Writes the bytes that `make(first, block)` makes for [first, first + block.size()) of `size` bytes as one
/// gzip member. `make` is called from several threads, once for each block; the blocks are deflated side by
/// side (ISA-L, level 1). The file depends on the bytes alone: no name, no time, no number of threads.
/// Throws std::system_error when the file cannot be written.
void write_gzip(const std::filesystem::path& file, std::int64_t size, std::int64_t block_bytes,
                const std::function<void(std::int64_t first, std::span<std::byte> block)>& make,
                const Progress& report = no_progress);

}  // namespace volsmooth
