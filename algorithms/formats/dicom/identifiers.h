#pragma once

#include "algorithms/formats/dicom/attributes.h"

namespace volsmooth {

inline constexpr Attribute kSopClass{{0x0008, 0x0016}, "UI", "SOPClassUID"};
inline constexpr Attribute kSopInstance{{0x0008, 0x0018}, "UI", "SOPInstanceUID"};
inline constexpr Attribute kStudy{{0x0020, 0x000d}, "UI", "StudyInstanceUID"};
inline constexpr Attribute kSeries{{0x0020, 0x000e}, "UI", "SeriesInstanceUID"};

}  // namespace volsmooth
