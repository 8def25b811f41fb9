#include "service/http/problem_types.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "service/jobs/job_json.h"

namespace volsmooth {
namespace {

constexpr std::string_view kUriStart = "/problems/";

constexpr auto kTypes = std::to_array<ProblemType>({
    // The request's framing and head
    {"ambiguous-framing", 400, "The length of the request is ambiguous"},
    {"bad-chunk", 400, "Malformed chunked body"},
    {"bad-content-length", 400, "Malformed Content-Length"},
    {"bad-header", 400, "Malformed request head"},
    {"bad-host", 400, "Missing or malformed Host"},
    {"bad-target", 400, "Malformed request target"},
    {"content-too-large", 413, "The body is too large"},
    {"cross-origin", 403, "A page of another site sent this"},
    {"expectation-failed", 417, "Unknown expectation"},
    {"insufficient-scope", 403, "The token does not allow this"},
    {"unauthenticated", 401, "No valid token"},
    {"header-too-large", 431, "The request head is too large"},
    {"length-required", 411, "A body is needed"},
    {"misdirected-request", 421, "This host is not served here"},
    {"request-timeout", 408, "The request did not arrive in time"},
    {"unknown-method", 501, "Unknown HTTP method"},
    {"unsupported-transfer-coding", 501, "Unsupported transfer coding"},
    {"unsupported-version", 505, "Unsupported HTTP version"},
    {"uri-too-long", 414, "The request target is too long"},
    // What is asked for
    {"bad-id", 400, "Malformed id"},
    {"bad-json", 400, "Malformed JSON"},
    {"bad-multipart", 400, "Malformed multipart body"},
    {"bad-parameter", 422, "A parameter has a bad value"},
    {"bad-query", 400, "Bad query parameter"},
    {"delivery-refused", 502, "The destination refused results"},
    {"digest-mismatch", 422, "The body does not have the digest that was sent"},
    {"gone", 410, "It existed, and was deleted"},
    {"idempotency-in-flight", 409, "The same request is being answered"},
    {"idempotency-mismatch", 422, "The key was used for another request"},
    {"job-too-expensive", 422, "The job would take too long"},
    {"job-too-large", 422, "The job would take too much memory"},
    {"method-not-allowed", 405, "The method is not offered here"},
    {"node-refused", 502, "A node refused"},
    {"node-unreachable", 502, "A node cannot be reached"},
    {"not-acceptable", 406, "None of the accepted media types is available"},
    {"not-found", 404, "There is no such thing"},
    {"precondition-failed", 412, "A precondition does not hold"},
    {"queue-full", 429, "The queue is full"},
    {"quota", 429, "The quota is used up"},
    {"range-not-satisfiable", 416, "The range lies outside the file"},
    {"series-incomplete", 502, "The series did not come whole"},
    {"source-not-found", 422, "The source has no such series"},
    {"unknown-algorithm", 422, "Unknown method"},
    {"unknown-field", 422, "Unknown member"},
    {"unsupported-media-type", 415, "Unsupported media type"},
    {"volume-in-use", 409, "The volume is in use"},
    // Uploaded files
    {"decompression-limit", 413, "The file unpacks to more than is allowed"},
    {"dicom-bad-attribute", 422, "Bad DICOM attribute"},
    {"dicom-bad-length", 422, "Bad length of a DICOM data element"},
    {"dicom-bad-orientation", 422, "Bad position or orientation in a DICOM file"},
    {"dicom-bad-pixel-format", 422, "Unsupported DICOM pixel format"},
    {"dicom-bad-rescale", 422, "Bad intensity scaling in a DICOM file"},
    {"dicom-bad-spacing", 422, "Bad pixel spacing in a DICOM file"},
    {"dicom-bad-vr", 422, "Bad value representation in a DICOM file"},
    {"dicom-decode-failed", 422, "The DICOM files cannot be decoded"},
    {"dicom-duplicate-slice", 422, "Two slices are the same"},
    {"dicom-inconsistent-series", 422, "The slices do not make up one volume"},
    {"dicom-missing-attribute", 422, "A DICOM attribute is missing"},
    {"dicom-mixed-patient", 422, "More than one patient or study"},
    {"dicom-mixed-series", 422, "More than one series"},
    {"dicom-nesting", 422, "DICOM sequences nested too deeply"},
    {"dicom-no-images", 422, "No DICOM images"},
    {"dicom-no-pixels", 422, "A DICOM file without pixels"},
    {"dicom-nonuniform-spacing", 422, "Unevenly spaced slices"},
    {"dicom-pixel-length", 422, "The wrong number of pixels in a DICOM file"},
    {"dicom-suspicious-preamble", 422, "A DICOM file that is a program as well"},
    {"dicom-too-few-slices", 422, "Too few slices"},
    {"dicom-too-many-elements", 413, "Too many data elements in a DICOM file"},
    {"dicom-transfer-syntax", 415, "Unsupported DICOM transfer syntax"},
    {"dicom-truncated", 422, "A DICOM file is cut short"},
    {"dicom-unknown-series", 422, "No such series in the upload"},
    {"dicom-unsupported-photometric", 422, "Unsupported DICOM pixel colours"},
    {"dicom-unsupported-sop-class", 422, "Unsupported kind of DICOM object"},
    {"empty-file", 422, "The file is empty"},
    {"gzip-corrupt", 422, "Corrupt gzip data"},
    {"gzip-trailing-data", 422, "Data after the end of the gzip stream"},
    {"gzip-truncated", 422, "The gzip stream is cut short"},
    {"multipart-corrupt", 422, "Malformed multipart upload"},
    {"multipart-too-many-parts", 413, "The multipart upload has too many parts"},
    {"nested-compression", 415, "Compressed twice"},
    {"nifti-bad-dimensions", 422, "Bad dimensions in the NIfTI header"},
    {"nifti-bad-extension", 422, "Bad NIfTI header extension"},
    {"nifti-bad-header", 422, "Bad NIfTI header"},
    {"nifti-bad-offset", 422, "Bad data offset in the NIfTI header"},
    {"nifti-bad-orientation", 422, "Bad orientation in the NIfTI header"},
    {"nifti-bad-scaling", 422, "Bad intensity scaling in the NIfTI header"},
    {"nifti-bad-spacing", 422, "Bad voxel spacing in the NIfTI header"},
    {"nifti-split-pair", 422, "Half of a NIfTI header/image pair"},
    {"nifti-trailing-data", 422, "Data after the voxels"},
    {"nifti-truncated-data", 422, "The voxels are cut short"},
    {"nifti-truncated-header", 422, "The NIfTI header is cut short"},
    {"non-finite-voxels", 422, "Voxels that are not numbers"},
    {"unsupported-datatype", 422, "Unsupported voxel type"},
    {"unsupported-dimensionality", 422, "Unsupported number of dimensions"},
    {"unsupported-format", 415, "Unsupported file format"},
    {"volume-too-large", 422, "The volume is too large"},
    {"zip-corrupt", 422, "Corrupt zip archive"},
    {"zip-duplicate-entry", 422, "The zip archive holds a name twice"},
    {"zip-encrypted", 415, "The zip archive is encrypted"},
    {"zip-overlap", 422, "Entries of the zip archive overlap"},
    {"zip-too-many-entries", 413, "The zip archive has too many entries"},
    {"zip-unsafe-entry", 422, "The zip archive holds something other than files"},
    {"zip-unsafe-name", 422, "Unsafe name in the zip archive"},
    {"zip-unsupported-method", 415, "Unsupported compression method in the zip archive"},
    // The service's own troubles
    {"attempts-exhausted", 500, "The job was given up"},
    {"insufficient-storage", 507, "Not enough free storage"},
    {"integrity-failure", 500, "A stored file is damaged"},
    {"internal", 500, "Internal error"},
    {"not-ready", 503, "The service is not ready"},
    {"store-unavailable", 503, "The store is not available"},
    {"too-many-connections", 503, "Too many connections"},
});

}  // namespace

std::span<const ProblemType> problem_types() {
  return kTypes;
}

const ProblemType& problem_type(std::string_view slug) {
  const auto row = std::ranges::find(kTypes, slug, &ProblemType::slug);
  if (row == kTypes.end()) throw std::logic_error("no problem type " + std::string(slug));
  return *row;
}

nlohmann::json problem_document(const Problem& problem) {
  return completed_problem(to_json(problem));
}

nlohmann::json completed_problem(nlohmann::json document) {
  const auto uri = document.at("type").get<std::string>();
  const ProblemType& type = problem_type(std::string_view(uri).substr(kUriStart.size()));
  document["title"] = type.title;
  document["status"] = type.status;
  return document;
}

}  // namespace volsmooth
