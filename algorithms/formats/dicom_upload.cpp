#include "algorithms/formats/dicom_upload.h"

#include <cstring>

#include "algorithms/formats/multipart_body.h"
#include "algorithms/formats/zip_directory.h"

namespace volsmooth {

bool is_part10(std::span<const std::byte> file) {
  constexpr std::size_t kPreamble = 128;
  return file.size() >= kPreamble + 4 && std::memcmp(file.data() + kPreamble, "DICM", 4) == 0;
}

bool looks_like_dicom_upload(std::span<const std::byte> head) {
  return is_part10(head) || looks_like_zip(head) || looks_like_multipart(head);
}

}  // namespace volsmooth
