#include "algorithms/formats/dicom/instances.h"

#include <algorithm>
#include <string_view>

#include "algorithms/formats/dicom/identifiers.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "algorithms/formats/dicom_upload.h"

namespace volsmooth {
namespace {

std::string uid_of(const Attributes& attributes, const Attribute& attribute) {
  constexpr std::size_t kLongestUid = 64;  // PS3.5, 6.2
  attributes.need(attribute);
  std::string uid = attributes.text(attribute);
  if (uid.size() > kLongestUid ||
      !std::ranges::all_of(uid, [](char c) { return c == '.' || (c >= '0' && c <= '9'); }))
    refuse_dicom("dicom-bad-attribute", say(attribute) + " must be a UID of at most 64 digits and dots.");
  return uid;
}

InstanceIdentity identity_of(std::span<const std::byte> part10) {
  const WalkedFile file(part10);
  const Attributes attributes(file);
  return {uid_of(attributes, kSopClass), uid_of(attributes, kSopInstance), uid_of(attributes, kStudy),
          uid_of(attributes, kSeries)};
}

}  // namespace

tl::expected<std::vector<InstanceIdentity>, Refusal> read_instances(std::span<const std::byte> upload,
                                                                    const ReadLimits& limits) {
  if (looks_like_zip(upload))
    return refuse("unsupported-format", "Send the instances as they are, in a multipart/related body.");
  auto files = UploadedFiles::in(upload, limits);
  if (!files) return tl::unexpected(files.error());
  std::vector<InstanceIdentity> instances;
  for (std::size_t which = 0; which < files->count(); ++which) {
    const auto stored = files->stored(which);
    if (!is_part10(stored))
      return refuse("dicom-no-images", "A part of the body is not a DICOM file; send Part 10 files only.");
    const auto plain = files->open(which);
    if (!plain) return tl::unexpected(plain.error());
    auto identity = or_refusal([&] { return identity_of(plain->bytes); });
    if (!identity) return tl::unexpected(identity.error());
    identity->offset = stored.data() - upload.data();
    identity->bytes = std::ssize(stored);
    instances.push_back(*std::move(identity));
  }
  if (instances.empty()) return refuse("dicom-no-images", "The body holds no DICOM file.");
  return instances;
}

}  // namespace volsmooth
