#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace volsmooth {

struct Tag {
  std::uint16_t group = 0, element = 0;
  auto operator<=>(const Tag&) const = default;
};

/// A data element, an item of a sequence, or a fragment of encapsulated pixels, where it lies in its file.
struct Element {
  Tag tag;
  std::array<char, 2> vr{};  ///< blank in implicit files, and of items
  std::uint32_t next = 0;    ///< index of the element after all that is inside this one
  std::size_t offset = 0;    ///< of its value in the file
  std::size_t length = 0;    ///< of its value: as declared, or to its delimiter
};

/// How the pixels of a transfer syntax are packed.
struct TransferSyntax {
  std::string_view uid;
  bool explicit_vr = true;
  bool big_endian = false;
  bool deflated = false;
  bool encapsulated = false;
  bool lossy = false;
};

/// One that is read; nothing for any other.
const TransferSyntax* find_transfer_syntax(std::string_view uid);

/// One Part 10 file, every element of which lies inside the file and inside what holds it.
class WalkedFile {
 public:
  /// Walks the meta header and the data set (PS3.10 section 7, PS3.5 section 7), 32 levels deep at the most;
  /// encapsulated pixels as items. `file` must outlive the object; it is in any transfer syntax but the
  /// deflated one. PixelData, when it is the last element, may reach beyond the end of the file.
  ///
  /// Throws Refused: dicom-suspicious-preamble, dicom-truncated, dicom-bad-length, dicom-bad-vr,
  /// dicom-nesting, dicom-transfer-syntax, dicom-missing-attribute (no transfer syntax), dicom-bad-attribute,
  /// dicom-too-many-elements.
  explicit WalkedFile(std::span<const std::byte> file);

  std::span<const std::byte> bytes() const { return file_; }
  const std::vector<Element>& elements() const { return elements_; }  ///< in the file's order, depth first
  std::uint32_t dataset_begin() const { return dataset_begin_; }      ///< those before are the meta header
  const TransferSyntax& transfer_syntax() const { return *transfer_syntax_; }
  std::span<const std::byte> value(const Element& element) const;  ///< as far as the file reaches

 private:
  std::span<const std::byte> file_;
  std::vector<Element> elements_;
  std::uint32_t dataset_begin_ = 0;
  const TransferSyntax* transfer_syntax_ = nullptr;
};

inline constexpr Tag kItem{0xfffe, 0xe000}, kItemEnd{0xfffe, 0xe00d}, kSequenceEnd{0xfffe, 0xe0dd};
inline constexpr Tag kPixelData{0x7fe0, 0x0010};

/// The UID of the transfer syntax that a Part 10 file's meta header names, and where the data set begins.
/// Throws Refused as above.
struct MetaHeader {
  std::string transfer_syntax;
  std::size_t uid_offset = 0;  ///< of the transfer syntax' UID
  std::size_t dataset_offset = 0;
};
MetaHeader read_meta_header(std::span<const std::byte> file);

}  // namespace volsmooth
