#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace volsmooth::test {

/// Names of patients to be put where clients can put text, none of which any other text holds by chance.
class PlantedNames {
 public:
  /// The letters by which a name is found again.
  static std::string core(int number) {
    std::string letters = "qx";
    for (int digit = 0; digit < 4; ++digit, number /= 5)
      letters += std::array{"bzu", "vjo", "wki", "gya", "fpe"}[number % 5];
    return letters;
  }
  /// As it is written: "Qxbzubzubzubzuström, Zoë", in UTF-8.
  static std::string name(int number) {
    std::string text = core(number);
    text[0] = 'Q';
    return text + "str\xC3\xB6m, Zo\xC3\xAB";
  }
  static std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) (out += '%') += hex(std::string(1, c));
    return out;
  }

  /// Whether `text` holds the letters, in whatever case: as they are (so also in Latin-1, UTF-8, JSON), in
  /// UTF-16 of either order, percent-encoded, in hexadecimal digits or in base64.
  static bool is_in(std::string_view text, const std::string& letters) {
    const std::string lower = lowered(text), tail = letters.substr(1);  // of the first, digits tell the case
    for (const std::string& form :
         {letters, wide(letters, false), wide(letters, true), lowered(hex(tail)), lowered(escaped(tail))})
      if (lower.find(form) != std::string::npos) return true;
    // What is around it decides the first and the last digits, and what case it has the others.
    std::string upper_first = letters;
    upper_first[0] = static_cast<char>(std::toupper(upper_first[0]));
    for (const std::string& spelt : {letters, upper_first})
      for (std::size_t before = 0; before < 3; ++before) {
        const std::string digits = base64(std::string(before, 'x') + spelt);
        if (text.find(digits.substr(before == 0 ? 0 : before + 1, digits.size() / 4 * 4 - 8)) !=
            std::string::npos)
          return true;
      }
    return false;
  }

  static std::string hex(std::string_view text) {
    std::string out;
    for (const char c : text)
      for (const int shift : {4, 0}) out += "0123456789ABCDEF"[(static_cast<unsigned char>(c) >> shift) & 15];
    return out;
  }
  static std::string base64(std::string_view text) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t at = 0; at < text.size(); at += 3) {
      unsigned block = 0;
      for (std::size_t i = at; i < at + 3; ++i)
        block = block << 8 | (i < text.size() ? static_cast<unsigned char>(text[i]) : 0U);
      for (const int shift : {18, 12, 6, 0}) out += kDigits[(block >> shift) & 63];
    }
    return out;
  }
  static std::string wide(std::string_view text, bool big_endian) {
    std::string out;
    for (const char c : text) out += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
    return out;
  }

 private:
  static std::string lowered(std::string_view text) {
    std::string lower(text);
    std::ranges::transform(lower, lower.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return lower;
  }
};

}  // namespace volsmooth::test
