#include "service/jobs/ids.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <system_error>

namespace volsmooth {
namespace {

constexpr std::string_view kAlphabet = "abcdefghijklmnopqrstuvwxyz234567";
constexpr std::size_t kRandomCharacters = 16;
constexpr std::size_t kLongestId = 64;

bool is_id_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}

}  // namespace

std::string new_id(std::string_view prefix) {
  std::array<unsigned char, kRandomCharacters> random{};
  if (::getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    throw std::system_error(errno, std::generic_category(), "getrandom");
  std::string id(prefix);
  for (const unsigned char byte : random) id += kAlphabet[byte % kAlphabet.size()];
  return id;
}

bool has_form_of_new_id(std::string_view text) {
  const auto dash = text.find('-');
  return dash != std::string_view::npos && text.size() - dash - 1 == kRandomCharacters &&
         text.find_first_not_of(kAlphabet, dash + 1) == std::string_view::npos;
}

bool is_id_shaped(std::string_view text) {
  return !text.empty() && text.size() <= kLongestId && std::ranges::all_of(text, is_id_character);
}

}  // namespace volsmooth
