#include "algorithms/volume/instruction_set.h"

namespace volsmooth {
namespace {

std::vector<InstructionSet> detect() {
  std::vector<InstructionSet> sets{InstructionSet::kBaseline};
#if defined(__x86_64__)
  if (kAllInstructionSets && __builtin_cpu_supports("avx2")) sets.push_back(InstructionSet::kAvx2);
  if (kAllInstructionSets && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
    sets.push_back(InstructionSet::kAvx512);
#endif
  return sets;
}

}  // namespace

const std::vector<InstructionSet>& instruction_sets() {
  static const std::vector<InstructionSet> sets = detect();
  return sets;
}

}  // namespace volsmooth
