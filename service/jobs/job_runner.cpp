#include "service/jobs/job_runner.h"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "service/jobs/stored_files.h"
#include "service/storage/digest.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

/// Why a job failed that threw: a full disk can be helped, the rest is ours.
Problem problem_of(const std::exception& thrown) {
  if (is_of_full_disk(thrown))
    return {"insufficient-storage",
            "The disk was full while the job ran; free some space and submit it again."};
  return {"internal", "The job could not be finished; the fault is the service's, see its log."};
}

/// Fills in what only storing knows of a result, and makes its bytes durable.
void seal(const fs::path& directory, Result& result, const RunningJob& running) {
  if (fs::path(result.name).filename() != result.name)
    throw std::logic_error("a result's name is not a plain file name");
  const fs::path file = directory / result.name;
  const FileDigest digest = digest_of(file, [&] { running.throw_if_interrupted(); });
  sync_path(file);
  result.bytes = digest.bytes;
  result.sha256 = digest.sha256;
  result.block_sums = digest.block_sums;
}

}  // namespace

void JobRunner::run(ClaimedJob& claim) const {
  const std::string place = results_directory(claim.job());
  try {
    if (auto results = compute(claim)) {
      publish(claim, *std::move(results));
    } else {
      files_.abandon_directory(place);
      claim.fail(std::move(results.error()));
    }
  } catch (const Cancelled&) {
    files_.abandon_directory(place);
    claim.end_interrupted();
  } catch (const std::exception& thrown) {
    spdlog::error("job {} attempt {}: {}", claim.job().id, claim.job().attempt, thrown.what());
    files_.abandon_directory(place);
    claim.fail(problem_of(thrown));
  }
}

tl::expected<std::vector<Result>, Problem> JobRunner::compute(ClaimedJob& claim) const {
  const Job& job = claim.job();
  RunningJob& running = claim.running();
  const StageProgress report = [&](std::string_view stage, double fraction) {
    if (running.report(stage, fraction)) wake_(job.id);
  };
  report("read", 0);

  // The volume cannot be deleted while the job runs, unless the job itself was: then it is interrupted.
  const auto volume = VolumeStore(database_).find(job.tenant, job.order.volume);
  if (!volume) throw Cancelled();
  const fs::path file = files_.path_of(volume_file(volume->id));
  if (!fs::exists(file) ||
      digest_of(file, [&] { running.throw_if_interrupted(); }).sha256 != volume->sha256) {
    StoredFiles(database_, files_).check(volume_file(volume->id));  // records it: nobody is to get it
    return tl::unexpected(Problem{"integrity-failure",
                                  "The stored volume is not what was uploaded any more; upload it again."});
  }

  const fs::path output_dir = files_.begin_directory(results_directory(job));
  auto results = engine_.compute({file, *volume, job.order, job.parameters, output_dir, threads_}, report);
  if (results)
    for (Result& result : *results) seal(output_dir, result, running);
  return results;
}

void JobRunner::publish(ClaimedJob& claim, std::vector<Result> results) const {
  const std::string place = results_directory(claim.job());
  files_.adopt_directory(place);
  bool seen = false;
  try {
    seen = claim.succeed(std::move(results));
  } catch (...) {
    // Nobody knows whether the row will point to them: the next start sees, and sweeps them if not.
    if (!database_.condemned()) files_.remove(place);
    throw;
  }
  if (!seen) files_.remove(place);
}
}  // namespace volsmooth
