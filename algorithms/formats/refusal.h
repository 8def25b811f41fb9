#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace volsmooth {

/// Why an input was not accepted. `slug` is stable and becomes `/problems/<slug>`; `detail` says what was
/// wrong and what would be right, in one or two sentences that echo no byte of the input but numbers from its
/// header.
struct Refusal {
  std::string slug;
  std::string detail;
  std::map<std::string, double> numbers =
      {};  ///< members of the problem document, such as the number of bad voxels
  std::map<std::string, std::map<std::string, double>> counts =
      {};  ///< more members: how many there are of what, such as images by series
};

inline tl::unexpected<Refusal> refuse(std::string slug, std::string detail) {
  return tl::unexpected(Refusal{std::move(slug), std::move(detail)});
}

}  // namespace volsmooth
