#pragma once

#include <utility>

#include "algorithms/formats/refusal.h"

namespace volsmooth {

/// Thrown inside this directory where a refusal would otherwise pass through every reader of an attribute;
/// the functions of series.h and uploaded_files.h catch it.
struct Refused {
  Refusal refusal;
};

[[noreturn]] inline void refuse_dicom(std::string slug, std::string detail) {
  throw Refused{{std::move(slug), std::move(detail)}};
}

/// What `work` gives, or the refusal it threw.
template <class Work>
auto or_refusal(const Work& work) -> tl::expected<decltype(work()), Refusal> {
  try {
    return work();
  } catch (const Refused& refused) {
    return tl::unexpected(refused.refusal);
  }
}

}  // namespace volsmooth
