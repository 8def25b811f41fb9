#include "algorithms/formats/zip_name.h"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace volsmooth {
namespace {

constexpr std::size_t kLongestName = 1024;

/// Takes one character off the front of UTF-8 (RFC 3629); nothing: it is none.
std::optional<std::uint32_t> next_character(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::size_t length = byte(0) < 0x80 ? 1 : byte(0) >> 5 == 0x6 ? 2 : byte(0) >> 4 == 0xe ? 3 : 4;
  if (length > text.size() || (length == 4 && byte(0) >> 3 != 0x1e)) return std::nullopt;
  std::uint32_t character = length == 1 ? byte(0) : byte(0) & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if (byte(i) >> 6 != 2) return std::nullopt;
    character = character << 6 | (byte(i) & 0x3fU);
  }
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = character >= 0xd800 && character < 0xe000;
  if (character < kLeast[length] || character > 0x10ffff || surrogate) return std::nullopt;
  text.remove_prefix(length);
  return character;
}

bool is_unsafe(std::uint32_t character) {
  const auto within = [character](std::uint32_t from, std::uint32_t to) {
    return character >= from && character <= to;
  };
  return within(0, 0x1f) || within(0x7f, 0x9f) || character == '\\' || within(0x200e, 0x200f) ||
         within(0x2028, 0x202e) || within(0x2066, 0x2069) || character == 0x061c;
}

/// Calls `use` with every part between slashes.
template <class Use>
void for_each_part(std::string_view name, const Use& use) {
  while (!name.empty()) {
    const std::size_t length = std::min(name.find('/'), name.size());
    use(name.substr(0, length));
    name.remove_prefix(std::min(length + 1, name.size()));
  }
}

}  // namespace

bool is_safe_name(std::string_view name) {
  if (name.empty() || name.size() > kLongestName || name.front() == '/') return false;
  if (name.size() > 1 && name[1] == ':') return false;
  bool safe = true;
  for_each_part(name, [&](std::string_view part) { safe = safe && part != ".."; });
  while (safe && !name.empty()) {
    const auto character = next_character(name);
    safe = character && !is_unsafe(*character);
  }
  return safe;
}

std::string folded_name(std::string_view name) {
  std::string folded;
  for_each_part(name, [&](std::string_view part) {
    if (!part.empty() && part != ".") folded.append("/").append(part);
  });
  std::ranges::transform(folded, folded.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return folded;
}

}  // namespace volsmooth
