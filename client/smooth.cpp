#include "client/smooth.h"

#include <unistd.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "client/catalogue.h"
#include "client/names.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

/// Cancels the job that it guards unless that came to its end.
class CancelOnExit {
 public:
  CancelOnExit(Api& api, std::string id) : api_(api), id_(std::move(id)) {}
  CancelOnExit(const CancelOnExit&) = delete;
  ~CancelOnExit() {
    if (!id_.empty()) static_cast<void>(api_.cancel(id_));  // a server that is gone has nothing to cancel
  }
  void ended() { id_.clear(); }

 private:
  Api& api_;
  std::string id_;
};

/// All names are checked before anything is computed; where the server chooses the isovalue, any isovalue's.
Expected<void> check_names(const Options& options, const OutputFolder& folder, const Json& method) {
  NamePlan plan{.parts = method.value("parts", std::vector<std::string>{}),
                .mesh_formats = options.order.mesh_formats,
                .outputs = options.order.outputs,
                .isovalues = options.order.isovalues};
  plan.with_original = !plan.parts.empty();
  if (plan.parts.empty()) plan.parts = {options.order.method};
  std::vector<std::string> names;
  for (const auto& input : options.inputs) {
    const std::string stem = stem_of(input);
    for (const std::string& name : predicted_names(plan)) names.push_back(file_name(stem, name));
    if (!plan.isovalues.automatic) continue;
    for (const std::string& part : plan.parts) {
      if (auto free = folder.check_none_begins(file_name(stem, part + "_iso")); !free) return free;
    }
  }
  return folder.check_free(names);
}

Expected<Json> run_job(const Options& options, const Session& session, const std::string& volume,
                       const std::string& what) {
  const auto submitted = session.api.submit(order_document(options.order, volume));
  if (!submitted) return submitted;
  const auto id = submitted->at("id").get<std::string>();
  CancelOnExit guard(session.api, id);
  auto job = wait_for_end(session, id, what);
  if (job) guard.ended();
  return job;
}

/// A cancelled job lets go of its volume in a moment; one that goes on all the same keeps it. Any other
/// refusal stands.
void give_up_volume(const Session& session, const std::string& id) {
  constexpr int kTries = 20;
  constexpr std::chrono::milliseconds kPause{150};
  for (int tries = 1; tries <= kTries; ++tries) {
    const auto deleted = session.api.delete_volume(id);
    if (deleted || deleted.error().code != ExitCode::kTryLater) return;
    std::this_thread::sleep_for(kPause);
  }
}

Expected<void> smooth_one(const Options& options, const Session& session, const OutputFolder& folder,
                          const std::filesystem::path& input) {
  const auto volume = upload_volume(session, input, options.query);
  if (!volume) return tl::unexpected(volume.error());
  const auto volume_id = volume->at("id").get<std::string>();
  auto job = run_job(options, session, volume_id, name_of(input));
  if (!job) {
    give_up_volume(session, volume_id);
    return tl::unexpected(job.error());
  }
  if (const auto outcome = outcome_of(*job); !outcome) return outcome;

  const Fetching fetching{folder, stem_of(input), options.order.isovalues.values, options.force};
  const auto paths = fetch_results(session, *job, fetching);
  if (!paths) return tl::unexpected(paths.error());
  for (const std::string& path : *paths) session.console.line(path);
  (*job)["files"] = *paths;
  session.console.document(*job);
  if (!session.server_is_private) return {};
  const auto deleted = session.api.delete_job(job->at("id").get<std::string>());
  return deleted ? session.api.delete_volume(volume_id) : deleted;
}

}  // namespace

Expected<void> check_inputs(const std::vector<std::filesystem::path>& inputs) {
  for (const auto& input : inputs) {
    std::error_code error;
    if (access(input.c_str(), R_OK) != 0) {
      return fail(ExitCode::kNoInput, input.string() + " cannot be read: " + std::strerror(errno) + ".");
    }
    if (!std::filesystem::is_regular_file(input, error) && !std::filesystem::is_directory(input, error)) {
      return fail(ExitCode::kNoInput, input.string() + " is neither a file nor a folder.");
    }
  }
  return {};
}

Expected<void> smooth(const Options& options, const Session& session) {
  const auto folder = OutputFolder::open(options.output_folder);
  if (!folder) return tl::unexpected(folder.error());
  const auto method = find_method(session.api, options.order.method);
  if (!method) return tl::unexpected(method.error());
  if (const auto free = check_names(options, *folder, *method); !options.force && !free) return free;

  std::size_t refused = 0;
  for (const auto& input : options.inputs) {
    auto one = smooth_one(options, session, *folder, input);
    if (one) continue;
    if (options.inputs.size() == 1) return one;
    one.error().sentence = input.string() + ": " + one.error().sentence;
    if (one.error().code != ExitCode::kBadData) return one;
    session.console.complain(one.error());
    ++refused;
  }
  if (refused == 0) return {};
  return fail(ExitCode::kBadData, std::to_string(refused) + " of " + std::to_string(options.inputs.size()) +
                                      " inputs were not smoothed, for the reasons above.");
}

}  // namespace volsmooth
