#pragma once

#include <string>

namespace volsmooth {

/// What stands before a data set in a file (DICOM PS3.10, 7.1): the preamble, and the meta information with
/// these UIDs.
std::string part10_head(const std::string& sop_class, const std::string& sop_instance,
                        const std::string& transfer_syntax);

}  // namespace volsmooth
