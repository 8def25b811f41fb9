#include "algorithms/formats/dicom/data_set.h"

#include <gdcmDict.h>
#include <gdcmDicts.h>
#include <gdcmExplicitDataElement.h>
#include <gdcmGlobal.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmSwapper.h>

#include <array>
#include <istream>
#include <optional>
#include <sstream>
#include <streambuf>

#include "algorithms/formats/dicom/elements.h"
#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

constexpr std::uint32_t kSopClass = 0x00080016, kSopInstance = 0x00080018, kReferencedClass = 0x00081150,
                        kReferencedInstance = 0x00081155;
const char* const kExplicitLittleEndian = "1.2.840.10008.1.2.1";
/// Of this program, drawn once.
const char* const kImplementation = "2.25.329398750995055558337414549041764335356";
const char* const kImplementationVersion = "VOLSMOOTH";

gdcm::Tag tag_of(std::uint32_t tag) {
  return {static_cast<std::uint16_t>(tag >> 16), static_cast<std::uint16_t>(tag & 0xffff)};
}

/// GDCM stops at elements that are out of order, and says nothing. Without what stands behind them an object
/// could be of nobody.
void check_all_read(const gdcm::DataSet& set, std::span<const std::byte> part10) {
  const WalkedFile walked(part10);
  const auto& elements = walked.elements();
  for (std::uint32_t i = walked.dataset_begin(); i < elements.size(); i = elements[i].next) {
    const Tag& tag = elements[i].tag;
    if (tag.group >= kPixelData.group || set.FindDataElement(gdcm::Tag(tag.group, tag.element))) continue;
    refuse_dicom("dicom-decode-failed", "The attributes of a DICOM file are out of order.");
  }
}

/// Where the dictionary leaves a choice, the words that fit `is_signed`.
std::optional<gdcm::VR> vr_of(const gdcm::DataElement& element, bool is_signed) {
  const gdcm::VR written = element.GetVR();
  if (written != gdcm::VR::INVALID && written != gdcm::VR::UN) return written;
  const gdcm::DictEntry& entry = gdcm::Global::GetInstance().GetDicts().GetDictEntry(element.GetTag());
  switch (const gdcm::VR known = entry.GetVR()) {
    case gdcm::VR::INVALID:
    case gdcm::VR::UN:
      return std::nullopt;
    case gdcm::VR::US_SS:
      return is_signed ? gdcm::VR::SS : gdcm::VR::US;
    case gdcm::VR::OB_OW:
    case gdcm::VR::US_OW:
    case gdcm::VR::US_SS_OW:
      return gdcm::VR::OW;
    default:
      return known;
  }
}

gdcm::DataSet cleaned(const gdcm::DataSet& set, bool is_signed) {
  gdcm::DataSet clean;
  for (const gdcm::DataElement& element : set.GetDES()) {
    const gdcm::Tag& tag = element.GetTag();
    if (tag.GetGroup() % 2 == 1 || tag.GetElement() == 0) continue;
    const auto vr = vr_of(element, is_signed);
    if (!vr) continue;
    if (*vr == gdcm::VR::SQ) {
      std::vector<gdcm::DataSet> items = items_of(set, static_cast<std::uint32_t>(tag.GetElementTag()));
      for (gdcm::DataSet& item : items) item = cleaned(item, is_signed);
      set_sequence(clean, tag.GetElementTag(), items);
    } else {
      gdcm::DataElement copy(element);
      copy.SetVR(*vr);
      clean.Replace(copy);
    }
  }
  return clean;
}

/// Bytes to read from where they lie, which a std::istringstream would copy.
class ByteBuffer : public std::streambuf {
 public:
  explicit ByteBuffer(std::span<const std::byte> bytes) {
    char* const begin = reinterpret_cast<char*>(const_cast<std::byte*>(bytes.data()));
    setg(begin, begin, begin + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode) override {
    const off_type origin = from == std::ios::beg   ? 0
                            : from == std::ios::cur ? gptr() - eback()
                                                    : egptr() - eback();
    return seekpos(origin + offset, std::ios::in);
  }
  pos_type seekpos(pos_type position, std::ios::openmode) override {
    if (position < 0 || position > egptr() - eback()) return off_type{-1};
    setg(eback(), eback() + static_cast<off_type>(position), egptr());
    return position;
  }
};

void append(std::string& file, std::uint16_t element, std::string_view vr, std::string value) {
  const bool is_bytes = vr == "OB";
  if (value.size() % 2 == 1) value += '\0';
  const auto put = [&file](auto number) {
    file.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  put(std::uint16_t{0x0002});
  put(element);
  file += vr;
  if (is_bytes) put(std::uint16_t{0});
  is_bytes ? put(static_cast<std::uint32_t>(value.size())) : put(static_cast<std::uint16_t>(value.size()));
  file += value;
}

std::string meta_header(const gdcm::DataSet& set) {
  std::string meta;
  append(meta, 0x0001, "OB", std::string("\0\1", 2));
  append(meta, 0x0002, "UI", text_of(set, kSopClass));
  append(meta, 0x0003, "UI", text_of(set, kSopInstance));
  append(meta, 0x0010, "UI", kExplicitLittleEndian);
  append(meta, 0x0012, "UI", kImplementation);
  append(meta, 0x0013, "SH", std::string(kImplementationVersion) + " ");
  const auto length = static_cast<std::uint32_t>(meta.size());
  std::string header;
  append(header, 0x0000, "UL", std::string(reinterpret_cast<const char*>(&length), sizeof length));
  return header + meta;
}

}  // namespace

void set_text(gdcm::DataSet& set, std::uint32_t tag, gdcm::VR vr, std::string_view value) {
  std::string padded(value);
  if (padded.size() % 2 == 1) padded += vr == gdcm::VR::UI ? '\0' : ' ';
  set_bytes(set, tag, vr, std::as_bytes(std::span(padded)));
}

void set_bytes(gdcm::DataSet& set, std::uint32_t tag, gdcm::VR vr, std::span<const std::byte> bytes) {
  gdcm::DataElement element(tag_of(tag));
  element.SetVR(vr);
  element.SetByteValue(reinterpret_cast<const char*>(bytes.data()), static_cast<std::uint32_t>(bytes.size()));
  set.Replace(element);
}

void set_sequence(gdcm::DataSet& set, std::uint32_t tag, const std::vector<gdcm::DataSet>& items) {
  gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
  sequence->SetLengthToUndefined();
  for (const gdcm::DataSet& content : items) {
    gdcm::Item item;
    item.SetVLToUndefined();
    item.SetNestedDataSet(content);
    sequence->AddItem(item);
  }
  gdcm::DataElement element(tag_of(tag));
  element.SetVR(gdcm::VR::SQ);
  element.SetValue(*sequence);
  element.SetVLToUndefined();
  set.Replace(element);
}

void set_code(gdcm::DataSet& set, std::uint32_t sequence, const DicomCode& code) {
  gdcm::DataSet item;
  set_text(item, 0x00080100, gdcm::VR::SH, code.value);
  set_text(item, 0x00080102, gdcm::VR::SH, code.scheme);
  set_text(item, 0x00080104, gdcm::VR::LO, code.meaning);
  set_sequence(set, sequence, {item});
}

void remove(gdcm::DataSet& set, std::uint32_t tag) {
  set.Remove(tag_of(tag));
}

void set_us(gdcm::DataSet& set, std::uint32_t tag, std::uint16_t value) {
  set_array<std::uint16_t>(set, tag, gdcm::VR::US, std::span(&value, 1));
}

void set_ul(gdcm::DataSet& set, std::uint32_t tag, std::uint32_t value) {
  set_array<std::uint32_t>(set, tag, gdcm::VR::UL, std::span(&value, 1));
}

bool has(const gdcm::DataSet& set, std::uint32_t tag) {
  return set.FindDataElement(tag_of(tag));
}

std::string text_of(const gdcm::DataSet& set, std::uint32_t tag) {
  const gdcm::ByteValue* value = has(set, tag) ? set.GetDataElement(tag_of(tag)).GetByteValue() : nullptr;
  if (value == nullptr) return {};
  std::string text(value->GetPointer(), value->GetLength());
  text.erase(text.find_last_not_of(std::string_view(" \0", 2)) + 1);
  return text;
}

std::vector<gdcm::DataSet> items_of(const gdcm::DataSet& set, std::uint32_t tag) {
  if (!has(set, tag)) return {};
  const auto sequence = set.GetDataElement(tag_of(tag)).GetValueAsSQ();
  if (!sequence) return {};
  std::vector<gdcm::DataSet> items;
  for (gdcm::SequenceOfItems::SizeType i = 1; i <= sequence->GetNumberOfItems(); ++i)
    items.push_back(sequence->GetItem(i).GetNestedDataSet());
  return items;
}

gdcm::DataSet reference_item(const InstanceReference& reference) {
  gdcm::DataSet item;
  set_text(item, kReferencedClass, gdcm::VR::UI, reference.sop_class_uid);
  set_text(item, kReferencedInstance, gdcm::VR::UI, reference.sop_instance_uid);
  return item;
}

gdcm::DataSet public_attributes(std::span<const std::byte> part10) {
  ByteBuffer buffer(part10);
  std::istream stream(&buffer);
  gdcm::Reader reader;
  reader.SetStream(stream);
  if (!reader.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010)))
    refuse_dicom("dicom-decode-failed", "The attributes of a DICOM file cannot be read.");
  const gdcm::DataSet& set = reader.GetFile().GetDataSet();
  check_all_read(set, part10);
  const gdcm::ByteValue* signedness =
      has(set, 0x00280103) ? set.GetDataElement(tag_of(0x00280103)).GetByteValue() : nullptr;
  const bool is_signed =
      signedness != nullptr && signedness->GetLength() > 0 && *signedness->GetPointer() == 1;
  return cleaned(set, is_signed);
}

void append_long_header(std::vector<std::byte>& file, std::uint32_t tag, std::string_view vr,
                        std::uint32_t length) {
  const auto put = [&file](const void* bytes, std::size_t count) {
    const auto* first = static_cast<const std::byte*>(bytes);
    file.insert(file.end(), first, first + count);
  };
  const std::array<std::uint16_t, 2> group_and_element{static_cast<std::uint16_t>(tag >> 16),
                                                       static_cast<std::uint16_t>(tag & 0xffff)};
  const std::uint16_t reserved = 0;
  put(group_and_element.data(), sizeof group_and_element);
  put(vr.data(), vr.size());
  put(&reserved, sizeof reserved);
  put(&length, sizeof length);
}

std::vector<std::byte> part10_file(const gdcm::DataSet& set) {
  std::ostringstream stream;
  stream << std::string(128, '\0') << "DICM" << meta_header(set);
  set.Write<gdcm::ExplicitDataElement, gdcm::SwapperNoOp>(stream);
  const std::string file = std::move(stream).str();
  const auto bytes = std::as_bytes(std::span(file));
  return {bytes.begin(), bytes.end()};
}

}  // namespace volsmooth
