#pragma once

#include <isa-l/igzip_lib.h>

#include <cstddef>
#include <cstdint>
#include <span>

/// ISA-L as it is called here. Its assembler leaves the upper halves of vector registers in use, and as long
/// as they are, SSE instructions of the thread wait for them: what computes in double takes twice its time.
/// So every call gives them back.
namespace volsmooth::isal {

int inflate(inflate_state& state);
int deflate(isal_zstream& stream);
int deflate_stateless(isal_zstream& stream);

/// Of gzip and zip, going on from `crc`.
std::uint32_t crc32(std::uint32_t crc, std::span<const std::byte> bytes);

}  // namespace volsmooth::isal
