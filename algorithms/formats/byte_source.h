#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include "algorithms/formats/gzip_reader.h"
#include "algorithms/formats/input_file.h"

namespace volsmooth {

/// The content of a file from front to back, inflated if it is gzip by its content (never by its name).
class ByteSource {
 public:
  ByteSource(const std::filesystem::path& file, const ReadLimits& limits);

  /// Fills `out` as far as the content reaches; fewer bytes than asked for mean its end. Refusals: those of
  /// `GzipReader`.
  tl::expected<std::size_t, Refusal> read(std::span<std::byte> out);

  /// Passes over `count` bytes; the number that there were.
  tl::expected<std::int64_t, Refusal> skip(std::int64_t count, const std::function<void()>& after_chunk);

  bool is_gzip() const { return gzip_.has_value(); }
  std::int64_t file_size() const { return file_.size(); }
  double fraction_read() const;

 private:
  InputFile file_;
  std::optional<GzipReader> gzip_;
};

/// The name of the compression that content beginning with `head` is in, if any that is known.
std::optional<std::string_view> compression_of(std::span<const std::byte> head);

}  // namespace volsmooth
