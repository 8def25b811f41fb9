#include "algorithms/formats/dicom/uploaded_files.h"

#include <algorithm>
#include <memory>
#include <string_view>

#include "algorithms/formats/dicom/elements.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom_upload.h"
#include "algorithms/formats/isal.h"
#include "algorithms/formats/multipart_body.h"
#include "algorithms/formats/zip_entry.h"

namespace volsmooth {
namespace {

using namespace std::string_view_literals;

constexpr std::int64_t kFreeInflatedBytes = std::int64_t{32} << 20;  // of one file, whatever the ratio
constexpr std::size_t kMostKeptBytes = std::size_t{256} << 20;
constexpr std::size_t kMostOpen = 64;
constexpr std::size_t kInflatedAtOnce = std::size_t{1} << 20;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

ZipLimits zip_limits(const ReadLimits& limits) {
  return {.max_inflate_ratio = limits.max_inflate_ratio, .free_unpacked_bytes = limits.free_inflated_bytes};
}

void check_inflated(std::size_t inflated, std::size_t deflated, const ReadLimits& limits) {
  const auto free = static_cast<std::size_t>(std::min(limits.free_inflated_bytes, kFreeInflatedBytes));
  const bool over = inflated > free &&
                    static_cast<double>(inflated) > limits.max_inflate_ratio * static_cast<double>(deflated);
  if (over) refuse_dicom("decompression-limit", "A deflated DICOM file inflates to far more than its size.");
}

/// Appends what a raw deflate stream holds (PS3.5, annex A.5). Throws Refused: dicom-truncated,
/// dicom-decode-failed, decompression-limit.
void inflate(std::span<const std::byte> deflated, const ReadLimits& limits, std::vector<std::byte>& out) {
  const auto state = std::make_unique<inflate_state>();
  isal_inflate_init(state.get());
  state->next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(deflated.data()));
  state->avail_in = static_cast<std::uint32_t>(deflated.size());
  const std::size_t begin = out.size();
  while (state->block_state != ISAL_BLOCK_FINISH) {
    const std::size_t at = out.size();
    out.resize(at + kInflatedAtOnce);
    state->next_out = reinterpret_cast<std::uint8_t*>(out.data() + at);
    state->avail_out = kInflatedAtOnce;
    const bool broken = isal::inflate(*state) != ISAL_DECOMP_OK;
    out.resize(at + (kInflatedAtOnce - state->avail_out));
    if (broken) refuse_dicom("dicom-decode-failed", "The deflated data set of a file is damaged.");
    if (out.size() == at && state->block_state != ISAL_BLOCK_FINISH)
      refuse_dicom("dicom-truncated", "The deflated data set of a file ends before its end.");
    check_inflated(out.size() - begin, deflated.size(), limits);
  }
}

/// The explicit little endian file that a deflated one is: data set inflated, transfer syntax said anew.
/// Empty for a file in another transfer syntax.
std::vector<std::byte> inflated_if_deflated(std::span<const std::byte> file, const ReadLimits& limits) {
  constexpr std::string_view kExplicit = "1.2.840.10008.1.2.1";
  const MetaHeader meta = read_meta_header(file);
  const TransferSyntax* syntax = find_transfer_syntax(meta.transfer_syntax);
  if (syntax == nullptr || !syntax->deflated) return {};
  if (file.size() - meta.dataset_offset > 0xffffffffU)
    refuse_dicom("decompression-limit", "A deflated DICOM file is longer than 4 GiB.");
  std::vector<std::byte> plain(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(meta.dataset_offset));
  const auto uid = std::span(plain).subspan(meta.uid_offset, meta.transfer_syntax.size());
  std::ranges::fill(uid, std::byte{0});
  std::ranges::copy(bytes_of(kExplicit), uid.begin());
  inflate(file.subspan(meta.dataset_offset), limits, plain);
  return plain;
}

}  // namespace

tl::expected<UploadedFiles, Refusal> UploadedFiles::in(std::span<const std::byte> upload,
                                                       const ReadLimits& limits) {
  UploadedFiles files;
  files.limits_ = limits;
  if (is_part10(upload)) {
    files.add(upload);
  } else if (looks_like_zip(upload)) {
    auto directory = read_zip_directory(upload, zip_limits(limits));
    if (!directory) return tl::unexpected(directory.error());
    for (ZipEntry& entry : *directory) files.add(upload, std::move(entry));
  } else {
    const auto parts = multipart_parts(upload);
    if (!parts) return tl::unexpected(parts.error());
    for (const auto part : *parts) files.add(part);
  }
  return files;
}

void UploadedFiles::add(std::span<const std::byte> stored, std::optional<ZipEntry> packed) {
  largest_bytes_ = std::max(largest_bytes_, packed ? packed->size : stored.size());
  entries_.push_back({.stored = stored, .packed = std::move(packed)});
}

int UploadedFiles::open_at_once() const {
  return static_cast<int>(std::clamp<std::size_t>(kMostKeptBytes / largest_bytes_, 1, kMostOpen));
}

tl::expected<OpenedFile, Refusal> UploadedFiles::open(std::size_t which) {
  Entry& entry = entries_.at(which);
  const std::lock_guard unpacking(*entry.unpacking);
  {
    const std::lock_guard keeping(*keeping_);
    if (entry.kept) return *entry.kept;
  }
  auto file = unpacked(entry);
  if (file) keep(entry, *file);
  return file;
}

tl::expected<OpenedFile, Refusal> UploadedFiles::unpacked(const Entry& entry) const {
  OpenedFile file{entry.stored};
  const auto take = [&file](std::vector<std::byte>&& bytes) {
    file.unpacked = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
    file.bytes = *file.unpacked;
  };
  if (entry.packed) {
    auto content = unpack(entry.stored, *entry.packed);
    if (!content) return tl::unexpected(content.error());
    take(*std::move(content));
  }
  if (is_part10(file.bytes)) {
    auto plain = or_refusal([&] { return inflated_if_deflated(file.bytes, limits_); });
    if (!plain) return tl::unexpected(plain.error());
    if (!plain->empty()) take(*std::move(plain));
  }
  return file;
}

/// Makes room for it by giving up all others.
void UploadedFiles::keep(Entry& entry, const OpenedFile& file) {
  const std::lock_guard keeping(*keeping_);
  const std::size_t bytes = file.unpacked ? file.unpacked->size() : 0;
  if (kept_bytes_ + bytes > kMostKeptBytes) {
    for (Entry& other : entries_)
      if (other.kept && other.kept->unpacked) other.kept.reset();
    kept_bytes_ = 0;
  }
  kept_bytes_ += bytes;
  entry.kept = file;
}

}  // namespace volsmooth
