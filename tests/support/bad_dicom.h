#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/support/dicom_maker.h"

namespace volsmooth::test {

/// One upload of DICOM and the answer it must get.
struct DicomUpload {
  std::string name;
  std::function<std::string()> make;
  int status = 422;
  std::string slug = {};     ///< of the problem; empty for a good upload
  std::string query = {};    ///< of the upload: "resample=uniform" or nothing
  std::string warning = {};  ///< how a warning of a good upload begins
};

/// The rows of bad input that concern DICOM, each a small series with something wrong, or odd, about it.
std::vector<DicomUpload> dicom_uploads();

/// A series of small slices, in a multipart body.
std::string good_dicom_upload();

/// A deflated file whose data set inflates to 300 MB.
std::string deflated_bomb();

}  // namespace volsmooth::test
