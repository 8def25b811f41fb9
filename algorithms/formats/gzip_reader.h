#pragma once

#include <isa-l/igzip_lib.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "algorithms/formats/input_file.h"
#include "algorithms/formats/read_limits.h"
#include "algorithms/formats/refusal.h"

namespace volsmooth {

/// Inflates a gzip file (RFC 1952) of any number of members. CRC and length of every member are verified, and
/// the limits hold for the sum of the members.
///
/// Refusals: gzip-truncated, gzip-corrupt, gzip-trailing-data (bytes after the last member that begin no
/// other), decompression-limit.
class GzipReader {
 public:
  GzipReader(InputFile& file, const ReadLimits& limits);

  /// Fills `out` as far as the content reaches; fewer bytes than asked for mean its verified end.
  tl::expected<std::size_t, Refusal> read(std::span<std::byte> out);

 private:
  tl::expected<bool, Refusal> begin_member();
  tl::expected<std::size_t, Refusal> inflate(std::span<std::byte> out);
  bool over_limit() const;

  InputFile& file_;
  ReadLimits limits_;
  std::unique_ptr<inflate_state> state_;
  bool in_member_ = false;
  std::int64_t members_ = 0;
  std::int64_t inflated_bytes_ = 0;
};

bool looks_like_gzip(std::span<const std::byte> head);

}  // namespace volsmooth
