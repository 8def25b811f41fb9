#include "algorithms/formats/dicom/elements.h"

#include <algorithm>
#include <cstring>

#include "algorithms/formats/byte_order.h"
#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t kPreamble = 128, kMetaBegin = 132;
constexpr std::size_t kMostElements = 2'000'000;
constexpr int kDeepest = 32;
constexpr Tag kTransferSyntaxUid{0x0002, 0x0010};
constexpr std::uint32_t kUndefined = 0xffffffff;

constexpr std::array kTransferSyntaxes{
    TransferSyntax{.uid = "1.2.840.10008.1.2", .explicit_vr = false},
    TransferSyntax{.uid = "1.2.840.10008.1.2.1"},
    TransferSyntax{.uid = "1.2.840.10008.1.2.1.99", .deflated = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.2", .big_endian = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.5", .encapsulated = true},                    // RLE
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.50", .encapsulated = true, .lossy = true},  // JPEG
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.51", .encapsulated = true, .lossy = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.53", .encapsulated = true, .lossy = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.55", .encapsulated = true, .lossy = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.57", .encapsulated = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.70", .encapsulated = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.80", .encapsulated = true},  // JPEG-LS
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.81", .encapsulated = true, .lossy = true},
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.90", .encapsulated = true},  // JPEG 2000
    TransferSyntax{.uid = "1.2.840.10008.1.2.4.91", .encapsulated = true, .lossy = true},
};

/// PS3.5, table 6.2-1, and how the length is written in explicit files (section 7.1.2).
constexpr std::array kShortForms = {"AE"sv, "AS"sv, "AT"sv, "CS"sv, "DA"sv, "DS"sv, "DT"sv,
                                    "FD"sv, "FL"sv, "IS"sv, "LO"sv, "LT"sv, "PN"sv, "SH"sv,
                                    "SL"sv, "SS"sv, "ST"sv, "TM"sv, "UI"sv, "UL"sv, "US"sv};
constexpr std::array kLongForms = {"OB"sv, "OD"sv, "OF"sv, "OL"sv, "OV"sv, "OW"sv, "SQ"sv,
                                   "SV"sv, "UC"sv, "UN"sv, "UR"sv, "UT"sv, "UV"sv};

std::string_view letters_of(const std::array<char, 2>& vr) {
  return {vr.data(), vr.size()};
}

void check_preamble(std::span<const std::byte> file) {
  constexpr std::array kPrograms = {"MZ"sv,
                                    "\x7f"
                                    "ELF"sv,
                                    "#!"sv,
                                    "\xfe\xed\xfa"sv,
                                    "\xce\xfa\xed\xfe"sv,
                                    "\xcf\xfa\xed\xfe"sv,
                                    "\xca\xfe\xba\xbe"sv};
  const std::string_view head(reinterpret_cast<const char*>(file.data()), kPreamble);
  if (std::ranges::any_of(kPrograms, [&](std::string_view magic) { return head.starts_with(magic); })) {
    refuse_dicom("dicom-suspicious-preamble", "The preamble of a file is the beginning of a program.");
  }
}

std::string uid_in(std::span<const std::byte> value) {
  std::string uid(reinterpret_cast<const char*>(value.data()), value.size());
  while (!uid.empty() && (uid.back() == '\0' || uid.back() == ' ')) uid.pop_back();
  return uid;
}

/// Walks a stretch of a file in one encoding.
class Walk {
 public:
  Walk(std::span<const std::byte> file, std::vector<Element>& elements, bool explicit_vr, bool big_endian,
       std::size_t at)
      : file_(file), elements_(elements), explicit_vr_(explicit_vr), big_endian_(big_endian), at_(at) {}

  std::size_t at() const { return at_; }
  bool ended() const { return at_ == file_.size(); }

  Tag peek_tag() {
    const std::size_t begin = at_;
    need(4, file_.size());
    const Tag tag = read_tag();
    at_ = begin;
    return tag;
  }

  /// One element of the level `depth`, with all that is inside it; `end`: of what holds it.
  Tag element(std::size_t end, int depth) {
    need(8, end);
    const std::size_t index = add({.tag = read_tag()});
    const Tag tag = elements_[index].tag;
    if (tag.group == 0xfffe) return tag;  // a delimiter: the caller knows whether it may stand here
    std::array<char, 2> vr{};
    const std::uint32_t length = read_length(vr, end);
    elements_[index].vr = vr;
    elements_[index].offset = at_;
    if (length == kUndefined) {
      open_ended(index, end, depth);
    } else {
      of_length(index, length, end, depth);
    }
    elements_[index].next = static_cast<std::uint32_t>(elements_.size());
    return tag;
  }

 private:
  template <class T>
  T read() {
    T value;
    std::memcpy(&value, file_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return big_endian_ ? byte_swapped(value) : value;
  }

  Tag read_tag() {
    const auto group = read<std::uint16_t>();
    return {group, read<std::uint16_t>()};
  }

  void need(std::size_t count, std::size_t end) const {
    if (end - at_ >= count) return;
    if (end == file_.size()) refuse_dicom("dicom-truncated", "A DICOM file ends inside a data element.");
    bad_length();
  }

  [[noreturn]] static void bad_length() {
    refuse_dicom("dicom-bad-length", "The length of a data element reaches beyond what holds it.");
  }

  std::size_t add(const Element& element) {
    if (elements_.size() == kMostElements) {
      refuse_dicom("dicom-too-many-elements",
                   "A DICOM file has more than " + std::to_string(kMostElements) + " data elements.");
    }
    elements_.push_back(element);
    return elements_.size() - 1;
  }

  /// VR and length (PS3.5, section 7.1).
  std::uint32_t read_length(std::array<char, 2>& vr, std::size_t end) {
    if (!explicit_vr_) return read<std::uint32_t>();
    vr = {read<char>(), read<char>()};
    if (std::ranges::find(kShortForms, letters_of(vr)) != kShortForms.end()) return read<std::uint16_t>();
    if (std::ranges::find(kLongForms, letters_of(vr)) == kLongForms.end()) {
      refuse_dicom("dicom-bad-vr", "A data element has a value representation that DICOM does not know.");
    }
    need(6, end);
    at_ += 2;
    return read<std::uint32_t>();
  }

  void of_length(std::size_t index, std::size_t length, std::size_t end, int depth) {
    Element& element = elements_[index];
    element.length = length;
    if (length > end - at_) {
      const bool last_of_file = depth == 0 && element.tag == kPixelData && end == file_.size();
      if (!last_of_file) bad_length();
      at_ = end;
      return;
    }
    const std::size_t value_end = at_ + length;
    if (holds_items(element, length)) {
      items(value_end, depth + 1, false);
    }
    at_ = value_end;
  }

  /// Implicit files do not say what is a sequence: its first item does. So do readers tell it apart.
  bool holds_items(const Element& element, std::size_t length) {
    if (letters_of(element.vr) == "SQ") return true;
    return !explicit_vr_ && element.tag != kPixelData && length >= 8 && peek_tag() == kItem;
  }

  void open_ended(std::size_t index, std::size_t end, int depth) {
    const Element element = elements_[index];
    const std::string_view vr = letters_of(element.vr);
    if (element.tag == kPixelData && depth == 0) {
      fragments(end);
    } else if (vr == "SQ" || !explicit_vr_) {
      items(end, depth + 1, true);
    } else if (vr == "UN") {  // a sequence in implicit little endian (PS3.5, section 6.2.2, note 5)
      Walk inside(file_, elements_, false, false, at_);
      inside.items(end, depth + 1, true);
      at_ = inside.at_;
    } else {
      refuse_dicom("dicom-bad-length", "A data element that is no sequence has no length.");
    }
    elements_[index].length = at_ - element.offset;
  }

  /// Items up to `end` or, where the sequence is open, its delimiter.
  void items(std::size_t end, int depth, bool open) {
    if (depth > kDeepest) {
      refuse_dicom("dicom-nesting",
                   "Sequences are nested more than " + std::to_string(kDeepest) + " levels deep.");
    }
    while (at_ < end) {
      need(8, end);
      const Tag tag = read_tag();
      const auto length = read<std::uint32_t>();
      if (open && tag == kSequenceEnd && length == 0) return;
      if (tag != kItem) refuse_dicom("dicom-bad-length", "A sequence holds what is no item.");
      item(length, end, depth);
    }
    if (open) unended(end);
  }

  void item(std::uint32_t length, std::size_t end, int depth) {
    const std::size_t index = add({.tag = kItem, .offset = at_});
    if (length != kUndefined && length > end - at_) bad_length();
    const std::size_t item_end = length == kUndefined ? end : at_ + length;
    bool closed = length != kUndefined;
    while (at_ < item_end) {
      need(8, item_end);
      if (length == kUndefined && peek_tag() == kItemEnd) {
        read_tag();
        if (read<std::uint32_t>() != 0) bad_length();
        closed = true;
        break;
      }
      if (element(item_end, depth).group == 0xfffe) bad_length();
    }
    if (!closed) unended(end);
    elements_[index].length = at_ - elements_[index].offset;
    elements_[index].next = static_cast<std::uint32_t>(elements_.size());
  }

  void fragments(std::size_t end) {
    while (at_ < end) {
      need(8, end);
      const Tag tag = read_tag();
      const auto length = read<std::uint32_t>();
      if (tag == kSequenceEnd && length == 0) return;
      if (tag != kItem || length > end - at_) bad_length();
      const std::size_t index = add({.tag = kItem, .offset = at_, .length = length});
      elements_[index].next = static_cast<std::uint32_t>(index + 1);
      at_ += length;
    }
    unended(end);
  }

  [[noreturn]] void unended(std::size_t end) const {
    if (end == file_.size()) refuse_dicom("dicom-truncated", "A DICOM file ends inside a sequence.");
    bad_length();
  }

  std::span<const std::byte> file_;
  std::vector<Element>& elements_;
  bool explicit_vr_, big_endian_;
  std::size_t at_;
};

/// Adds the elements of group 2, which are in explicit little endian always.
MetaHeader walk_meta_header(std::span<const std::byte> file, std::vector<Element>& elements) {
  if (file.size() < kMetaBegin) refuse_dicom("dicom-truncated", "A DICOM file ends inside its preamble.");
  check_preamble(file);
  Walk walk(file, elements, true, false, kMetaBegin);
  try {
    while (!walk.ended() && walk.peek_tag().group == 2) walk.element(file.size(), 0);
  } catch (const Refused& refused) {
    if (refused.refusal.slug != "dicom-bad-length") throw;
    refuse_dicom("dicom-truncated", "A DICOM file ends inside its meta header.");
  }
  const auto named = std::ranges::find(elements, kTransferSyntaxUid, &Element::tag);
  if (named == elements.end()) {
    refuse_dicom("dicom-missing-attribute",
                 "The meta header of a file names no transfer syntax (0002,0010).");
  }
  return {uid_in(file.subspan(named->offset, named->length)), named->offset, walk.at()};
}

}  // namespace

WalkedFile::WalkedFile(std::span<const std::byte> file) : file_(file) {
  const MetaHeader meta = walk_meta_header(file, elements_);
  dataset_begin_ = static_cast<std::uint32_t>(elements_.size());
  const TransferSyntax* syntax = find_transfer_syntax(meta.transfer_syntax);
  if (syntax == nullptr || syntax->deflated) {
    refuse_dicom("dicom-transfer-syntax",
                 "A file is in a transfer syntax that is not read. Convert it to explicit little endian.");
  }
  transfer_syntax_ = syntax;
  Walk walk(file, elements_, syntax->explicit_vr, syntax->big_endian, meta.dataset_offset);
  while (!walk.ended()) {
    const Tag tag = walk.element(file.size(), 0);
    if (tag.group == 0xfffe) refuse_dicom("dicom-bad-length", "A delimiter stands outside of any sequence.");
    if (tag.group < 4) refuse_dicom("dicom-bad-attribute", "A data element does not belong into a data set.");
  }
}

std::span<const std::byte> WalkedFile::value(const Element& element) const {
  return file_.subspan(element.offset, std::min(element.length, file_.size() - element.offset));
}

const TransferSyntax* find_transfer_syntax(std::string_view uid) {
  const auto found = std::ranges::find(kTransferSyntaxes, uid, &TransferSyntax::uid);
  return found == kTransferSyntaxes.end() ? nullptr : &*found;
}

MetaHeader read_meta_header(std::span<const std::byte> file) {
  std::vector<Element> elements;
  return walk_meta_header(file, elements);
}

}  // namespace volsmooth
