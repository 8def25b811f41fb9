#pragma once

#include <string>

#include "algorithms/formats/dicom/data_set.h"
#include "algorithms/formats/dicom/series.h"
#include "algorithms/formats/dicom/uids.h"

namespace volsmooth {

/// What was done to a series, when, and what the objects that come of it are to be called.
struct Derivation {
  std::string description;         ///< "mean-curvature-flow, flow_time_mm2 1": at most 1024 ASCII characters
  std::string series_description;  ///< at most 64 ASCII characters
  DicomCode code;                  ///< of CID 7203; no value: there is none for it
  std::int64_t series_number = 1, instance_number = 1;
  UidSeed series_seed{}, instance_seed{};
  std::string date, time;  ///< "20261125", "230000"
  std::string software_version;
};

/// Image Derivation (CID 7203): what comes nearest to a method; no value where none does.
DicomCode derivation_code(const std::string& method);

// What every object that is made of a series has in common.

/// The attributes of the patient, the study and the frame of reference of `source`, complete (empty where it
/// has none), and its character set.
gdcm::DataSet patient_and_study_of(const gdcm::DataSet& source);

/// The public attributes of the first slice's file. Throws Refused.
gdcm::DataSet attributes_of_first(const DicomSeries& series);

/// What was done as an algorithm with its parameters (PS3.3, table 10-19).
gdcm::DataSet algorithm_item(const Derivation& derivation);

/// Series, equipment and SOP Common of the new object.
void set_origin(gdcm::DataSet& set, const Derivation& derivation, const std::string& modality,
                const std::string& sop_class_uid, const std::string& sop_instance_uid);

/// The objects that hold the slices of a series, each once, in the slices' order.
std::vector<InstanceReference> source_instances(const DicomSeries& series);

/// Common Instance Reference (PS3.3, C.12.2): the whole source series.
void set_referenced_series(gdcm::DataSet& set, const DicomSeries& series);

}  // namespace volsmooth
