#pragma once

#include <vector>

#include "algorithms/formats/dicom/image.h"
#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// Orders the frames of one series along their normal and places them: everything of the series but `files`
/// and its UIDs. Throws Refused: dicom-too-few-slices, dicom-inconsistent-series, dicom-duplicate-slice,
/// dicom-nonuniform-spacing, dicom-bad-spacing, dicom-bad-orientation, volume-too-large.
DicomSeries stack_slices(std::vector<DicomImage> images, const SeriesOptions& options);

}  // namespace volsmooth
