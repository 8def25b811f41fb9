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

/// Defines `NAME##_for(set)`: the always inlined `void NAME(const ROW&)`, compiled for an instruction set.
#define VOLSMOOTH_ROW_KERNEL(NAME, ROW)                                  \
  void NAME##_baseline(const ROW& row) {                                 \
    NAME(row);                                                           \
  }                                                                      \
  VOLSMOOTH_AVX2 void NAME##_avx2(const ROW& row) {                      \
    NAME(row);                                                           \
  }                                                                      \
  VOLSMOOTH_AVX512 void NAME##_avx512(const ROW& row) {                  \
    NAME(row);                                                           \
  }                                                                      \
  void (*NAME##_for(InstructionSet set))(const ROW&) {                   \
    if (set == InstructionSet::kAvx512) return NAME##_avx512;            \
    return set == InstructionSet::kAvx2 ? NAME##_avx2 : NAME##_baseline; \
  }

}  // namespace volsmooth
