#pragma once

#include <string>
#include <string_view>

namespace volsmooth {

/// Counts the parts of a multipart body that streams by, by its boundary (RFC 2046, 5.1.1).
class PartCounter {
 public:
  explicit PartCounter(std::string_view boundary) : delimiter_("--" + std::string(boundary)) {}

  void see(std::string_view bytes) {
    window_ += bytes;
    std::size_t from = 0;
    for (std::size_t at; (at = window_.find(delimiter_, from)) != std::string::npos;) {
      ++delimiters_;
      from = at + delimiter_.size();
    }
    // What may be the start of a delimiter stays.
    const std::size_t kept = std::min(delimiter_.size() - 1, window_.size() - from);
    window_.erase(0, window_.size() - kept);
  }

  /// The last delimiter closes the body.
  int parts() const { return delimiters_ > 0 ? delimiters_ - 1 : 0; }

 private:
  const std::string delimiter_;
  std::string window_;
  int delimiters_ = 0;
};

}  // namespace volsmooth
