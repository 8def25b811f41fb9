#include "algorithms/formats/nifti_extensions.h"

#include "algorithms/formats/byte_order.h"
#include "algorithms/formats/nifti_limits.h"

namespace volsmooth {
namespace {

constexpr std::size_t kFlagBytes = 4;
constexpr std::size_t kLeastExtension = 16;  ///< extensions come in multiples of 16 bytes

/// Every extension begins with its size in bytes; together they must not reach past the voxels' begin. Less
/// than 16 bytes may be left over.
bool is_chain(std::span<const std::byte> chain, bool swapped) {
  if (chain.size() < kLeastExtension) return false;
  while (chain.size() >= kLeastExtension) {
    std::int32_t size;
    std::memcpy(&size, chain.data(), sizeof size);
    if (swapped) size = byte_swapped(size);
    if (size < 16 || size % 16 != 0 || static_cast<std::size_t>(size) > chain.size()) return false;
    chain = chain.subspan(static_cast<std::size_t>(size));
  }
  return true;
}

tl::expected<std::vector<std::byte>, Refusal> take(ByteSource& source, std::size_t count) {
  std::vector<std::byte> bytes(count);
  const auto got = source.read(bytes);
  if (!got) return tl::unexpected(got.error());
  if (*got < count) return refuse("nifti-truncated-data", "The file ends before its voxels begin.");
  return bytes;
}

}  // namespace

std::optional<Refusal> pass_extensions(ByteSource& source, const ParsedHeader& parsed,
                                       const NiftiLayout& layout, std::vector<std::string>& warnings) {
  if (layout.data_offset % 16 != 0) {
    warnings.emplace_back("offset-unaligned: vox_offset is not a multiple of 16 bytes.");
  }
  const auto flags = take(source, kFlagBytes);
  if (!flags) return flags.error();
  const bool extended = (*flags)[0] != std::byte{0};
  const std::int64_t gap = layout.data_offset - least_data_offset(parsed.fields.version);
  if (gap > kMostExtensionBytes) {
    if (extended) return Refusal{"nifti-bad-extension", "The header extensions are larger than 1 MiB."};
    return Refusal{"nifti-bad-offset", "vox_offset leaves more than 1 MiB between header and voxels."};
  }
  const auto chain = take(source, static_cast<std::size_t>(gap));
  if (!chain) return chain.error();
  if (!extended) return std::nullopt;
  if (!is_chain(*chain, parsed.swapped)) {
    return Refusal{"nifti-bad-extension",
                   "A header extension's size must be a multiple of 16 that ends before the voxels begin."};
  }
  warnings.emplace_back("extensions-dropped: header extensions are not kept, they may hold patient data.");
  return std::nullopt;
}

}  // namespace volsmooth
