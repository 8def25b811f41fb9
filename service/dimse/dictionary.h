#pragma once

namespace volsmooth {

/// Makes the command elements (DICOM PS3.7, table E.1-1) all that DCMTK knows of the dictionary of DICOM. It
/// needs no more to carry data sets, and its file of thousands of elements takes longer to read than an
/// association of a few instances.
void use_command_dictionary();

}  // namespace volsmooth
