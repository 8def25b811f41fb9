#include "service/pacs/instances.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string_view>

#include "algorithms/formats/zip_entry.h"

namespace volsmooth {
namespace {

[[noreturn]] void not_ours() {
  throw std::runtime_error("a stored DICOM result is not what was written");
}

std::vector<std::byte> content_of(const std::filesystem::path& file) {
  std::vector<std::byte> bytes(std::filesystem::file_size(file));
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!in) throw std::runtime_error("a stored result cannot be read");
  return bytes;
}

std::uint32_t little_endian(std::span<const std::byte> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(bytes[i]);
  return value;
}

constexpr std::size_t kPreamble = 128, kMetaStart = kPreamble + 4;
constexpr std::uint32_t kMetaGroup = 0x0002, kSopClass = 0x0002, kSopInstance = 0x0003;

/// One element of the meta information, which is always Explicit VR Little Endian.
struct Element {
  std::uint32_t group, number;
  std::span<const std::byte> value;
  std::size_t end;
};

Element element_at(std::span<const std::byte> file, std::size_t at) {
  const auto take = [&](std::size_t bytes) {
    if (file.size() - at < bytes) not_ours();
    const auto taken = file.subspan(at, bytes);
    at += bytes;
    return taken;
  };
  Element element{};
  element.group = little_endian(take(2));
  element.number = little_endian(take(2));
  const auto vr = take(2);
  const bool is_long = vr[0] == std::byte{'O'} || vr[0] == std::byte{'U'};
  const bool is_uid = vr[0] == std::byte{'U'} && (vr[1] == std::byte{'I'} || vr[1] == std::byte{'L'});
  std::uint32_t length = little_endian(take(2));
  if (is_long && !is_uid) length = little_endian(take(4));
  element.value = take(length);
  element.end = at;
  return element;
}

std::string uid_in(std::span<const std::byte> value) {
  std::string uid(reinterpret_cast<const char*>(value.data()), value.size());
  while (!uid.empty() && (uid.back() == '\0' || uid.back() == ' ')) uid.pop_back();
  return uid;
}

}  // namespace

DicomInstance instance_of(std::span<const std::byte> part10) {
  if (part10.size() < kMetaStart || uid_in(part10.subspan(kPreamble, 4)) != "DICM") not_ours();
  DicomInstance instance;
  for (std::size_t at = kMetaStart; at < part10.size();) {
    const Element element = element_at(part10, at);
    if (element.group != kMetaGroup) break;
    if (element.number == kSopClass) instance.sop_class_uid = uid_in(element.value);
    if (element.number == kSopInstance) instance.sop_instance_uid = uid_in(element.value);
    at = element.end;
  }
  if (instance.sop_instance_uid.empty()) not_ours();
  return instance;
}

void for_each_instance(const std::filesystem::path& file,
                       const std::function<void(const DicomInstance&, std::span<const std::byte>)>& body) {
  const std::vector<std::byte> content = content_of(file);
  if (!looks_like_zip(content)) return body(instance_of(content), content);
  const auto entries = read_zip_directory(content);
  if (!entries) not_ours();
  for (const ZipEntry& entry : *entries) {
    const auto unpacked = unpack(content, entry);
    if (!unpacked) not_ours();
    body(instance_of(*unpacked), *unpacked);
  }
}

}  // namespace volsmooth
