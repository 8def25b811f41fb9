#pragma once

#include <nlohmann/json.hpp>

#include "algorithms/formats/dicom/series.h"
#include "algorithms/formats/dicom/series_voxels.h"

namespace volsmooth {

/// {"volume": ...}: size, affine (LPS, three rows of four), voxel type, scaling, intensities, padding,
/// warnings.
nlohmann::json volume_answer(const DicomSeries& series, const SeriesVoxels& voxels);

}  // namespace volsmooth
