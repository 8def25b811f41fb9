#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "service/jobs/problem.h"

namespace volsmooth {

/// The boundary that a multipart/form-data Content-Type names; none for any other type or a bad boundary.
std::optional<std::string> multipart_boundary(std::string_view content_type);

/// Takes a multipart/form-data body apart as it arrives (RFC 7578, RFC 2046 5.1), strictly. Holds back no
/// more than a boundary or a part's head.
class MultipartReader {
 public:
  /// What happens with the parts; a problem ends the reading.
  struct Parts {
    std::function<tl::expected<void, Problem>(std::string_view name)> begin;
    std::function<tl::expected<void, Problem>(std::string_view bytes)> data;
  };
  MultipartReader(std::string_view boundary, Parts parts);

  tl::expected<void, Problem> read(std::string_view bytes);
  tl::expected<void, Problem> finish();  ///< bad-multipart unless the closing boundary was seen

 private:
  enum class Stage { kBoundary, kHead, kData, kEnd };
  tl::expected<bool, Problem> read_boundary();
  tl::expected<bool, Problem> read_head();
  tl::expected<bool, Problem> read_data();

  std::string delimiter_;  ///< CR LF -- boundary
  Parts parts_;
  Stage stage_ = Stage::kBoundary;
  std::string pending_ = "\r\n";  ///< as if a line had ended: the first delimiter needs no CR LF of its own
};

}  // namespace volsmooth
