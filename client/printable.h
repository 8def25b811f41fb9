#pragma once

#include <string>
#include <string_view>

namespace volsmooth {

/// Text for a terminal: control characters, which a server or a file name may hold, become '?'.
inline std::string printable(std::string_view text) {
  std::string safe(text);
  for (char& c : safe) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = '?';
  }
  return safe;
}

/// For messages. (A literal + text + a literal would do, but g++ 12 warns of it: bug 105651.)
inline std::string in_quotes(std::string_view text) {
  std::string result(1, '\'');
  result.append(printable(text)).push_back('\'');
  return result;
}

}  // namespace volsmooth
