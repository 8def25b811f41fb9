#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "algorithms/surface/mesh.h"
#include "algorithms/volume/volume.h"
#include "service/jobs/job.h"
#include "service/pipeline/pipeline.h"
#include "service/process/descriptor.h"

namespace volsmooth {

/// Why the DICOM objects of a job could not be made.
struct DeriveRefused {
  Problem problem;
};

/// Makes DICOM objects of what a job computed and of the originals in its upload, by volsmooth-ingest.
/// Everything throws DeriveRefused, std::system_error.
class DicomResults {
 public:
  DicomResults(const ComputeTask& task, const PipelineLimits& limits) : task_(task), limits_(limits) {}

  /// A memory file for voxels, which `write_series` uses as well: memory that is there is quick to write to.
  const Descriptor& voxel_memory();

  /// The objects that follow are made by this method; `parameters` are the resolved ones.
  void begin_method(const std::string& method, const ParameterValues& parameters);

  /// A zip of a derived series; the number of voxels that its stored values could not hold.
  std::int64_t write_series(const std::filesystem::path& file, const Volume& volume, const Progress& report);

  /// `format`: "stl" or "obj".
  void write_mesh(const std::filesystem::path& file, const std::string& format, const Mesh& mesh,
                  const Progress& report);
  void write_segmentation(const std::filesystem::path& file, std::span<const Mesh> meshes,
                          const Progress& report);

 private:
  nlohmann::json begin_object(const std::string& output, const std::string& series_seed);
  nlohmann::json derive(const std::filesystem::path& file, const nlohmann::json& options, int input,
                        const Progress& report);

  const ComputeTask& task_;
  const PipelineLimits& limits_;
  Descriptor voxels_;
  std::string method_, description_, mesh_series_seed_;
  int series_ = 0, mesh_series_ = 0, meshes_ = 0;  ///< numbers given out
};

}  // namespace volsmooth
