#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace volsmooth {

/// Why an input was not accepted. `slug` is stable and becomes `/problems/<slug>`; `detail` says what was
/// wrong and what would be right, in one or two sentences that echo no byte of the input but numbers from its
/// header.
struct Refusal {
  std::string slug;
  std::string detail;
  std::map<std::string, double> numbers =
      {};  ///< members of the problem document, such as the number of bad voxels
};

}  // namespace volsmooth
