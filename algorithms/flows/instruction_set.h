#pragma once

#include <vector>

namespace volsmooth {

/// What row kernels are compiled for, so that one binary is fast everywhere. All give the same bytes: none
/// has fused multiply-add, and no sum is reordered.
enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

/// Those that this processor has, best last.
const std::vector<InstructionSet>& instruction_sets();

#if defined(__x86_64__)
#define VOLSMOOTH_AVX2 [[gnu::target("avx2")]]
#define VOLSMOOTH_AVX512 [[gnu::target("avx512f,avx512vl,avx512dq,prefer-vector-width=512")]]
#else
#define VOLSMOOTH_AVX2
#define VOLSMOOTH_AVX512
#endif

}  // namespace volsmooth
