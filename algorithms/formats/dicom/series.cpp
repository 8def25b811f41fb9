#include "algorithms/formats/dicom/series.h"

#include <algorithm>
#include <map>
#include <set>

#include "algorithms/formats/dicom/image.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/slice_stack.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "algorithms/formats/dicom_upload.h"
#include "algorithms/formats/in_order.h"

namespace volsmooth {
namespace {

/// A DICOM file of the upload.
struct Object {
  std::size_t file = 0;
  DicomIdentity identity;
  bool is_image = false;
  tl::expected<DicomImage, Refusal>
      image;  ///< a refusal counts only when its series is the one that is meant
};

struct Contents {
  std::vector<Object> objects;
  std::size_t other_files = 0;
};

Object object_in(std::span<const std::byte> bytes, std::size_t which, const ReadLimits& limits) {
  const WalkedFile walked(bytes);
  Object object{which, identity_of(walked), false, {}};
  object.is_image = is_supported_image(object.identity.sop_class_uid);
  if (object.is_image) object.image = or_refusal([&] { return image_in(walked, object.identity, limits); });
  return object;
}

Contents contents_of(UploadedFiles& files, const SeriesOptions& options) {
  Contents contents;
  const auto look_into = [&](std::size_t which) -> std::optional<Object> {
    const auto file = files.open(which);
    if (!file) throw Refused{file.error()};
    if (!is_part10(file->bytes)) return std::nullopt;
    return object_in(file->bytes, which, options.limits);
  };
  const auto add = [&](std::size_t which, std::optional<Object>&& object) {
    if (object) {
      contents.objects.push_back(*std::move(object));
    } else {
      ++contents.other_files;
    }
    options.execution.report(static_cast<double>(which + 1) / static_cast<double>(files.count()));
  };
  make_in_order(files.count(), std::min(options.execution.threads, files.open_at_once()), look_into, add);
  return contents;
}

std::map<std::string, double> images_by_series(const Contents& contents) {
  std::map<std::string, double> counts;
  for (const Object& object : contents.objects)
    if (object.is_image) ++counts[object.identity.series_uid];
  return counts;
}

/// Of one patient and one study: told before anything is told of their series.
void check_one_patient(const Contents& contents, const std::string& series) {
  std::set<std::string> patients, studies;
  for (const Object& object : contents.objects) {
    if (!object.is_image || (!series.empty() && object.identity.series_uid != series)) continue;
    patients.insert(object.identity.patient);
    studies.insert(object.identity.study_uid);
  }
  if (patients.size() > 1 || studies.size() > 1)
    refuse_dicom("dicom-mixed-patient",
                 "The images are of more than one patient or study. Upload them one by one.");
}

std::string pick_series(const Contents& contents, const std::string& wanted) {
  const auto counts = images_by_series(contents);
  if (counts.empty() && contents.objects.empty())
    refuse_dicom("dicom-no-images", "The upload holds no DICOM file (Part 10, with DICM at byte 128).");
  if (counts.empty())
    refuse_dicom("dicom-unsupported-sop-class",
                 "The upload holds DICOM objects, but no CT, MR, PET or other volume image.");
  if (!wanted.empty()) {
    if (!counts.contains(wanted))
      throw Refused{{"dicom-unknown-series",
                     "No image of the upload belongs to the series that 'series' names.",
                     {},
                     {{"series", counts}}}};
    return wanted;
  }
  check_one_patient(contents, wanted);
  if (counts.size() > 1) {
    throw Refused{{"dicom-mixed-series",
                   "The upload holds images of more than one series. Say by series=UID which one is meant.",
                   {},
                   {{"series", counts}}}};
  }
  return counts.begin()->first;
}

void check_identity(const DicomIdentity& identity) {
  if (!identity.study_uid.empty() && !identity.series_uid.empty() && !identity.sop_instance_uid.empty())
    return;
  refuse_dicom("dicom-missing-attribute", "An image has no study, series or SOP instance UID.");
}

DicomSeries series_from(UploadedFiles& files, const SeriesOptions& options) {
  Contents contents = contents_of(files, options);
  const std::string chosen = pick_series(contents, options.series);
  check_one_patient(contents, chosen);
  std::vector<DicomImage> images;
  DicomIdentity identity;
  std::size_t ignored = contents.other_files;
  for (Object& object : contents.objects) {
    if (object.identity.series_uid != chosen) {
      ++ignored;
      continue;
    }
    if (!object.is_image)
      refuse_dicom("dicom-unsupported-sop-class",
                   "An object of the series is no CT, MR, PET or other volume image.");
    if (!object.image) throw Refused{object.image.error()};
    check_identity(object.identity);
    for (DicomFrame& frame : object.image->frames) frame.slice.file = object.file;
    images.push_back(*std::move(object.image));
    identity = std::move(object.identity);
  }
  DicomSeries series = stack_slices(std::move(images), options);
  series.study_uid = identity.study_uid;
  series.series_uid = identity.series_uid;
  if (ignored > 0)
    series.warnings.push_back("ignored-files: " + std::to_string(ignored) +
                              " files are no images of the series.");
  return series;
}

}  // namespace

tl::expected<DicomSeries, Refusal> read_series(std::span<const std::byte> upload,
                                               const SeriesOptions& options) {
  auto opened = UploadedFiles::in(upload, options.limits);
  if (!opened) return tl::unexpected(opened.error());
  const auto files = std::make_shared<UploadedFiles>(*std::move(opened));
  auto series = or_refusal([&] { return series_from(*files, options); });
  if (series) series->files = files;
  return series;
}

}  // namespace volsmooth
