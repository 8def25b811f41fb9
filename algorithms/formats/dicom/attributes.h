#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/formats/dicom/elements.h"

namespace volsmooth {

/// An attribute by the data dictionary (PS3.6): `vrs` are the value representations it may have, two letters
/// each.
struct Attribute {
  Tag tag;
  std::string_view vrs;
  std::string_view name;  ///< as the dictionary says it, for refusals
};

/// The attributes of a data set or of an item in a walked file, which must outlive it. Everything throws
/// Refused: dicom-bad-vr for an explicit VR that the attribute cannot have, dicom-bad-attribute for one that
/// is there twice or whose value is not what its VR says.
class Attributes {
 public:
  explicit Attributes(const WalkedFile& file);  ///< of its data set

  /// Nothing where it is absent; an empty value counts as absent.
  const Element* find(const Attribute& attribute) const;
  const Element& need(
      const Attribute& attribute) const;  ///< throws dicom-missing-attribute where it is absent

  std::string text(const Attribute& attribute) const;  ///< without padding; empty where it is absent
  std::optional<std::int64_t> number(const Attribute& attribute) const;  ///< of two bytes: US, SS
  std::optional<std::int64_t> number_as(const Attribute& attribute,
                                        bool is_signed) const;  ///< whatever its VR
  std::int64_t needed_number(const Attribute& attribute) const;
  std::optional<std::int64_t> integer_string(const Attribute& attribute) const;  ///< IS

  /// DS of exactly `count` finite numbers; nothing where it is absent. Throws `slug` for anything else.
  std::optional<std::vector<double>> decimals(const Attribute& attribute, std::size_t count,
                                              const char* slug) const;

  std::vector<Attributes> items(const Attribute& sequence) const;  ///< none where it is absent
  std::optional<Attributes> only_item(const Attribute& sequence) const;

 private:
  Attributes(const WalkedFile& file, std::uint32_t begin, std::uint32_t end)
      : file_(&file), begin_(begin), end_(end) {}

  const WalkedFile* file_;
  std::uint32_t begin_, end_;
};

/// As in "Rows (0028,0010)".
std::string say(const Attribute& attribute);

}  // namespace volsmooth
