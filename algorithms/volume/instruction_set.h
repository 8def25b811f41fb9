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

/// A function that works on a row.
template <class Row>
using RowKernel = void (*)(const Row&);

/// `kRun`, which is always inlined, compiled for an instruction set. Sanitizers instrument the source, which
/// is the same for all: built for them there is the baseline alone, in a third of the time.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kAllInstructionSets = false;
template <class Row, RowKernel<Row> kRun>
RowKernel<Row> row_kernel(InstructionSet) {
  return +[](const Row& row) { kRun(row); };
}
#else
inline constexpr bool kAllInstructionSets = true;
template <class Row, RowKernel<Row> kRun>
void run_baseline(const Row& row) {
  kRun(row);
}
template <class Row, RowKernel<Row> kRun>
VOLSMOOTH_AVX2 void run_avx2(const Row& row) {
  kRun(row);
}
template <class Row, RowKernel<Row> kRun>
VOLSMOOTH_AVX512 void run_avx512(const Row& row) {
  kRun(row);
}
template <class Row, RowKernel<Row> kRun>
RowKernel<Row> row_kernel(InstructionSet set) {
  if (set == InstructionSet::kAvx512) return run_avx512<Row, kRun>;
  return set == InstructionSet::kAvx2 ? run_avx2<Row, kRun> : run_baseline<Row, kRun>;
}
#endif

}  // namespace volsmooth
