#include "algorithms/formats/dicom/attributes.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "algorithms/formats/byte_order.h"
#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

[[noreturn]] void bad(const Attribute& attribute, const char* what,
                      const char* slug = "dicom-bad-attribute") {
  refuse_dicom(slug, say(attribute) + " " + what);
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.remove_suffix(1);
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  return text;
}

template <class T>
std::optional<T> parsed(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool may_have(const Attribute& attribute, const std::array<char, 2>& vr) {
  if (vr[0] == '\0') return true;
  for (std::size_t i = 0; i < attribute.vrs.size(); i += 2) {
    if (attribute.vrs.substr(i, 2) == std::string_view(vr.data(), 2)) return true;
  }
  return false;
}

}  // namespace

std::string say(const Attribute& attribute) {
  char tag[16];
  std::snprintf(tag, sizeof(tag), " (%04x,%04x)", attribute.tag.group, attribute.tag.element);
  return std::string(attribute.name) + tag;
}

Attributes::Attributes(const WalkedFile& file)
    : Attributes(file, file.dataset_begin(), static_cast<std::uint32_t>(file.elements().size())) {}

const Element* Attributes::find(const Attribute& attribute) const {
  const Element* found = nullptr;
  const auto& elements = file_->elements();
  for (std::uint32_t i = begin_; i < end_; i = elements[i].next) {
    if (elements[i].tag != attribute.tag) continue;
    if (found != nullptr) bad(attribute, "is there twice.");
    found = &elements[i];
  }
  if (found != nullptr && !may_have(attribute, found->vr)) {
    bad(attribute, "has a value representation that it cannot have.", "dicom-bad-vr");
  }
  return found == nullptr || found->length == 0 ? nullptr : found;
}

const Element& Attributes::need(const Attribute& attribute) const {
  const Element* element = find(attribute);
  if (element == nullptr) bad(attribute, "is missing or empty.", "dicom-missing-attribute");
  return *element;
}

std::string Attributes::text(const Attribute& attribute) const {
  const Element* element = find(attribute);
  if (element == nullptr) return {};
  const auto value = file_->value(*element);
  return std::string(trimmed({reinterpret_cast<const char*>(value.data()), value.size()}));
}

std::optional<std::int64_t> Attributes::number(const Attribute& attribute) const {
  const Element* element = find(attribute);
  return number_as(attribute, element != nullptr && element->vr == std::array{'S', 'S'});
}

std::optional<std::int64_t> Attributes::number_as(const Attribute& attribute, bool is_signed) const {
  const Element* element = find(attribute);
  if (element == nullptr) return std::nullopt;
  const auto value = file_->value(*element);
  std::uint16_t word;
  if (value.size() != sizeof(word)) bad(attribute, "is no single number of two bytes.");
  std::memcpy(&word, value.data(), sizeof(word));
  if (file_->transfer_syntax().big_endian) word = byte_swapped(word);
  return is_signed ? std::int64_t{static_cast<std::int16_t>(word)} : std::int64_t{word};
}

std::int64_t Attributes::needed_number(const Attribute& attribute) const {
  need(attribute);
  return *number(attribute);
}

std::optional<std::int64_t> Attributes::integer_string(const Attribute& attribute) const {
  const std::string value = text(attribute);
  if (value.empty()) return std::nullopt;
  const auto integer = parsed<std::int64_t>(value);
  if (!integer) bad(attribute, "is no integer.");
  return integer;
}

std::optional<std::vector<double>> Attributes::decimals(const Attribute& attribute, std::size_t count,
                                                        const char* slug) const {
  const std::string value = text(attribute);
  if (value.empty()) return std::nullopt;
  std::vector<double> numbers;
  for (std::string_view rest = value; numbers.size() <= count;) {
    const std::size_t end = rest.find('\\');
    const auto number = parsed<double>(rest.substr(0, end));
    if (!number || !std::isfinite(*number)) bad(attribute, "holds what is no finite decimal number.", slug);
    numbers.push_back(*number);
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  if (numbers.size() != count) bad(attribute, "has the wrong number of values.", slug);
  return numbers;
}

std::vector<Attributes> Attributes::items(const Attribute& sequence) const {
  const Element* element = find(sequence);
  if (element == nullptr) return {};
  const auto& elements = file_->elements();
  std::vector<Attributes> found;
  const auto first = static_cast<std::uint32_t>(element - elements.data() + 1);
  for (std::uint32_t i = first; i < element->next; i = elements[i].next) {
    if (elements[i].tag != kItem) bad(sequence, "is no sequence.");
    found.push_back(Attributes(*file_, i + 1, elements[i].next));
  }
  return found;
}

std::optional<Attributes> Attributes::only_item(const Attribute& sequence) const {
  const auto all = items(sequence);
  if (all.empty()) return std::nullopt;
  if (all.size() > 1) bad(sequence, "has more than one item.");
  return all.front();
}

}  // namespace volsmooth
