#pragma once

#include "algorithms/formats/dicom/derivation.h"

namespace volsmooth {

/// The attributes, all but instance number and pixels, of an image that is derived of `slice` (or of the
/// multi-frame object that it belongs to), whose attributes are `source`: those that still hold, the new
/// identity, and what was done. What an IOD requires and the original lacks is there, empty where that is
/// allowed.
gdcm::DataSet derived_attributes(const gdcm::DataSet& source, const DicomSeries& series,
                                 const DicomSlice& slice, const Derivation& derivation,
                                 const std::string& sop_instance_uid);

}  // namespace volsmooth
