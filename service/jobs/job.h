#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/method_info.h"
#include "algorithms/progress.h"
#include "service/jobs/problem.h"

namespace volsmooth {

using Time = std::chrono::system_clock::time_point;

/// How an upload is to be read; kept with the volume.
struct UploadOptions {
  std::optional<std::int64_t> volume_index;
  std::optional<double> non_finite;
  std::string series;    ///< DICOM series UID, of several in one upload
  std::string resample;  ///< "uniform": uneven DICOM slices are interpolated
};

/// A DICOM instance in an uploaded file.
struct ArrivedInstance {
  std::string sop_class_uid, sop_instance_uid, study_uid, series_uid;
  std::int64_t offset = 0, bytes = 0;  ///< of its Part 10 file in the uploaded one
};

/// What verification found in an uploaded file: the volume document without what storing adds.
struct VolumeFacts {
  std::string format;
  std::array<std::int64_t, 3> size{};
  std::array<double, 3> spacing_mm{};
  std::array<std::array<double, 4>, 4> affine{};  ///< voxel index -> mm in `frame`
  std::string frame;                              ///< "RAS" or "LPS"
  std::string voxel_type;
  double intensity_min = 0;
  double intensity_max = 0;
  std::vector<std::string> warnings;
};

/// A verified, durable upload. Immutable.
struct StoredVolume {
  std::string id;
  std::string tenant;  ///< whose it is
  UploadOptions options;
  VolumeFacts facts;
  std::int64_t bytes = 0;
  std::string sha256;           ///< of the bytes as uploaded, hex
  std::string block_sums = {};  ///< when it is stored; the store keeps them to itself
  Time created_at;
  std::optional<Time> expires_at = {};  ///< none: it is kept until somebody deletes it
};

/// A series that a job is to fetch from a node of the configuration before it can run, or one that devices
/// have sent to a preset.
struct DicomSource {
  std::string node, study, series;  ///< a name; two UIDs
  std::string preset = {};          ///< in place of a node
};

/// What a client asks for; all but `volume` (or `source`) has a default.
struct JobOrder {
  std::string volume;                 ///< empty as long as the series is still at its source
  std::optional<DicomSource> source;  ///< stays when the series is here
  std::string method = "mean-curvature-flow";
  ParameterValues parameters;                    ///< as asked; see Job::parameters for the resolved ones
  std::optional<std::vector<double>> isovalues;  ///< none: "auto"
  std::vector<std::string> mesh_formats = {"stl"};
  std::string mesh_frame;           ///< "RAS", "LPS", or empty: the volume's own
  std::string voxel_type = "same";  ///< or "float32"
  std::vector<std::string> outputs = {"nifti"};
  std::string destination;            ///< the node that gets the DICOM outputs; empty: none
  int priority = 0;                   ///< each step is worth a minute of waiting
  std::optional<int> keep_days = {};  ///< after the job's end; none: as the service does, 0: for ever
  std::string label;
};

/// What a job will take, known before it is accepted.
struct JobPlan {
  ParameterValues parameters;     ///< resolved: flow_time_mm2, step_mm2, steps, ...
  std::int64_t memory_bytes = 0;  ///< at the peak
  std::int64_t disk_bytes = 0;    ///< of its results, at the most
  bool is_long = false;           ///< takes more than seconds: not all places are for such jobs
};

/// One file that a job made.
struct Result {
  std::string name;  ///< such as "mean-curvature-flow_iso300.stl"
  std::string kind;  ///< "volume", "surface", "report", "picture", "series" or "dicom"
  std::string method;
  std::vector<double> isovalues;  ///< of a surface: one, or all of a file with many surfaces
  bool many_surfaces = false;     ///< tells a list of one isovalue from a number
  std::string frame;              ///< of a volume or surface, else empty
  std::string media_type;
  std::int64_t bytes = 0;
  std::string sha256;
  std::string block_sums = {};  ///< when it is stored; the store keeps them to itself
};

enum class JobState { kQueued, kRunning, kSucceeded, kFailed, kCancelled };

std::string_view name_of(JobState state);
std::optional<JobState> job_state_from(std::string_view name);
bool is_final(JobState state);

/// The life of a job, whole: queued -> running -> one of the final states; a running job goes back to queued
/// when the daemon stops or dies under it; a final one never changes.
bool can_become(JobState from, JobState to);

struct JobProgress {
  std::string
      stage;  ///< "queued", "waiting-for-source", "retrieve", "read", "flow", "surfaces", "write", "done"
  double fraction = 0;
  std::optional<double> eta_seconds;
};

enum class DeliveryState { kPending, kDelivered, kFailed };

std::string_view name_of(DeliveryState state);

/// How far the DICOM outputs of a succeeded job are on their way to its destination.
struct Delivery {
  std::string destination;
  DeliveryState state = DeliveryState::kPending;
  std::int64_t instances = 0, stored = 0, refused = 0;  ///< 0 instances until they are first looked at
  int tries = 0;                                        ///< that ended without an answer for every instance
  std::optional<Time> next_attempt_at;                  ///< after a try that failed
  std::optional<Problem> error;                         ///< of the last try
};

struct Job {
  std::string id;
  std::string tenant;  ///< whose it is
  JobState state = JobState::kQueued;
  JobOrder order;
  ParameterValues parameters;  ///< resolved
  std::int64_t memory_bytes = 0;
  std::int64_t disk_bytes = 0;
  bool is_long = false;
  JobProgress progress;
  Time created_at;
  std::optional<Time> started_at;
  std::optional<Time> finished_at;
  std::chrono::milliseconds keep = {};  ///< after its end; 0: for ever
  std::optional<Time> expires_at;       ///< of a final one
  std::optional<Problem> error;         ///< why it failed, or why it waits for its source
  std::optional<Time> next_attempt_at;  ///< of a job that waits for its source
  int source_tries = 0;                 ///< how often its source could not give the series
  std::vector<Result> results;
  std::optional<Delivery> delivery;
  int attempt = 0;  ///< how often it was claimed: the fence that a result must carry
};

/// Told how far a job is. Thread-safe; throws `Cancelled` to end it.
using StageProgress = std::function<void(std::string_view stage, double fraction)>;

/// All that the computing side needs of one job.
struct ComputeTask {
  std::filesystem::path volume_file;
  StoredVolume volume;
  JobOrder order;
  ParameterValues parameters;        ///< resolved
  std::filesystem::path output_dir;  ///< exists and is empty; results are written into it by their names
  int threads = 0;                   ///< 0: all cores
};

/// The computing side, handed to the service by main as plain functions (pipeline/pipeline.h makes them). A
/// problem is the input's or the order's fault; anything thrown but `Cancelled` is ours.
struct Engine {
  std::vector<MethodInfo> methods;
  /// What a job of a method takes of the memory; without isovalues, and for each of them.
  struct MethodCost {
    std::string method;
    std::int64_t fixed_bytes = 0;
    double bytes_per_voxel = 0, bytes_per_voxel_and_isovalue = 0;
  };
  std::vector<MethodCost> costs = {};  ///< as far as known
  struct Format {
    std::string name, media_type, description;
  };
  std::vector<Format> mesh_formats;

  /// Verifies an uploaded file completely; that may take a while.
  std::function<tl::expected<VolumeFacts, Problem>(const std::filesystem::path& file,
                                                   const UploadOptions& options, const Progress& report)>
      inspect;
  /// The instances in a file that a device sent, before they are a series.
  std::function<tl::expected<std::vector<ArrivedInstance>, Problem>(const std::filesystem::path& file,
                                                                    const Progress& report)>
      instances;
  /// Checks an order against its volume and resolves its parameters; cheap.
  std::function<tl::expected<JobPlan, Problem>(const JobOrder& order, const VolumeFacts& volume)> plan;
  /// Runs it. Result files are complete but not yet synced when it returns.
  std::function<tl::expected<std::vector<Result>, Problem>(const ComputeTask& task,
                                                           const StageProgress& report)>
      compute;
};

}  // namespace volsmooth
