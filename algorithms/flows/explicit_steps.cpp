#include "algorithms/flows/explicit_steps.h"

namespace volsmooth {

void take_steps(Volume& volume, std::int64_t steps, const ExplicitStep& step, const Progress& report) {
  const std::size_t count = voxels_of(volume).size();
  auto next = Volume::PixelContainer::New();
  next->Reserve(count);
  for (std::int64_t taken = 0; taken < steps; ++taken) {
    const auto begin = static_cast<double>(taken), all = static_cast<double>(steps);
    step(voxels_of(volume), {next->GetBufferPointer(), count},
         part_of(report, begin / all, (begin + 1) / all));
    Volume::PixelContainer::Pointer last = volume.GetPixelContainer();
    volume.SetPixelContainer(next);
    next = last;
  }
}

}  // namespace volsmooth
