#pragma once

#include <string>
#include <string_view>

namespace volsmooth {

inline constexpr const char* kOurAeTitle = "VOLSMOOTH";
inline constexpr const char* kAeTitleRule =
    "an AE title: 1 to 16 characters of ASCII without backslash, and no space at either end";

/// Whether it is an application entity title as DICOM writes it (PS3.5, 6.2, VR AE). They differ by case.
inline bool is_ae_title(std::string_view title) {
  constexpr std::size_t kLongest = 16;
  const auto is_good = [](char c) { return c >= ' ' && c <= '~' && c != '\\'; };
  if (title.empty() || title.size() > kLongest || title.front() == ' ' || title.back() == ' ') return false;
  for (const char c : title)
    if (!is_good(c)) return false;
  return true;
}

}  // namespace volsmooth
