#include "client/job_run.h"

#include <set>

#include "client/names.h"
#include "client/part_file.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

/// How long a request waits for the job's end: short with a bar, which gets its news from the answers.
constexpr std::chrono::seconds kBarWait{1}, kQuietWait{30};

/// How long a server that has answered before may be away, and how often it is asked.
constexpr std::chrono::seconds kPatience{30};
constexpr std::chrono::milliseconds kRetryPause{500};

bool may_pass(const Failure& failure, const Session& session) {
  const bool is_away = failure.code == ExitCode::kUnreachable || failure.code == ExitCode::kTryLater;
  return is_away && !session.server_is_private;
}

bool is_final(const std::string& state) {
  return state != "queued" && state != "running";
}

Expected<PartFile> download(const Session& session, const std::string& job, const Json& result,
                            const std::filesystem::path& path, ProgressBar& bar) {
  auto file = PartFile::create(path);
  if (!file) return file;
  const auto name = result.at("name").get<std::string>();
  const auto bytes = result.at("bytes").get<std::int64_t>();
  std::int64_t done = 0;
  const auto received = session.api.download(job, name, [&](std::string_view piece) {
    done += static_cast<std::int64_t>(piece.size());
    bar.show(view_of_transfer(path.filename().string(), "fetch", done, bytes));
    return file->write(piece);
  });
  if (!received) return tl::unexpected(received.error());
  if (const auto whole = file->finish(bytes, result.at("sha256").get<std::string>()); !whole) {
    return tl::unexpected(whole.error());
  }
  return file;
}

/// The results' names on the disk, in order; the names are the server's and not to be trusted.
Expected<std::vector<std::string>> names_of(const Json& results, const Fetching& fetching) {
  std::vector<std::string> names;
  for (const Json& result : results) {
    const std::string name = result_name(result, fetching.isovalues);
    if (!is_plain_name(name)) {
      return fail(ExitCode::kInternal, "The server names a result in a way that is no plain file name.");
    }
    names.push_back(file_name(fetching.stem, name));
  }
  if (std::set(names.begin(), names.end()).size() != names.size()) {
    return fail(ExitCode::kInternal, "The server gives two results the same name.");
  }
  return names;
}

}  // namespace

Expected<Json> upload_volume(const Session& session, const std::filesystem::path& input, const Query& query) {
  ProgressBar bar(!session.console.quiet);
  auto volume = session.api.upload(input, query, [&](std::int64_t sent, std::int64_t bytes) {
    bar.show(view_of_transfer(name_of(input), sent < bytes ? "upload" : "check", sent, bytes));
  });
  bar.wipe();
  if (!volume) return volume;
  for (const Json& warning : volume->value("warnings", Json::array())) {
    session.console.warn(name_of(input) + ": " +
                         (warning.is_string() ? warning.get<std::string>() : warning.dump()));
  }
  return volume;
}

Expected<Json> wait_for_end(const Session& session, const std::string& id, const std::string& what) {
  ProgressBar bar(!session.console.quiet);
  std::string stage;
  auto answered = std::chrono::steady_clock::now() - kPatience;
  for (;;) {
    auto job = session.api.wait(id, bar.is_shown() ? kBarWait : kQuietWait);
    const auto now = std::chrono::steady_clock::now();
    if (!job && may_pass(job.error(), session) && now - answered < kPatience) {
      session.console.note(job.error().sentence);
      session.interruption.waited(kRetryPause);
      continue;
    }
    if (!job || is_final(job->at("state").get<std::string>())) return job;
    answered = now;
    const ProgressView view = view_of(what, *job);
    if (view.stage != stage) session.console.note(what + ": " + view.stage);
    stage = view.stage;
    bar.show(view);
  }
}

Expected<void> outcome_of(const Json& job) {
  const auto state = job.at("state").get<std::string>();
  if (state == "succeeded") return {};
  if (state == "cancelled") return fail(ExitCode::kInterrupted, "The job was cancelled.");
  if (state == "failed") {
    const Json& problem = job.at("error");
    return tl::unexpected(Failure{exit_code_for_failed_job(problem), sentence_of(problem), problem});
  }
  return fail(ExitCode::kTryLater, "The job has not ended yet; volsmooth wait waits for it.");
}

Expected<std::vector<std::string>> fetch_results(const Session& session, const Json& job,
                                                 const Fetching& fetching) {
  const Json& results = job.at("results");
  const auto names = names_of(results, fetching);
  if (!names) return tl::unexpected(names.error());
  if (const auto free = fetching.folder.check_free(*names); !fetching.overwrite && !free) {
    return tl::unexpected(free.error());
  }

  std::vector<PartFile> files;
  ProgressBar bar(!session.console.quiet);
  for (std::size_t i = 0; i < results.size(); ++i) {
    auto file =
        download(session, job.at("id").get<std::string>(), results[i], fetching.folder / (*names)[i], bar);
    if (!file) return tl::unexpected(file.error());
    files.push_back(std::move(*file));
  }
  std::vector<std::string> paths;
  for (PartFile& file : files) {
    const auto path = file.publish(fetching.overwrite);
    if (!path) return tl::unexpected(path.error());
    paths.push_back(path->string());
  }
  return paths;
}

std::string file_name(const std::string& stem, const std::string& name) {
  return stem.empty() ? name : stem + '_' + name;
}

}  // namespace volsmooth
