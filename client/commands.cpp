#include "client/commands.h"

#include <stdexcept>

#include "client/catalogue.h"
#include "client/names.h"
#include "client/printable.h"
#include "client/smooth.h"
#include "client/tables.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

/// Prints a document: as it is with --json, else `text` of it. Text may be empty.
Expected<void> print(const Session& session, const Expected<Json>& document,
                     std::string (*text)(const Json&)) {
  if (!document) return tl::unexpected(document.error());
  std::string lines = text(*document);
  if (lines.ends_with('\n')) lines.pop_back();
  if (!lines.empty()) session.console.line(lines);
  session.console.document(*document);
  return {};
}

std::string id_text(const Json& document) {
  return document.at("id").get<std::string>();
}
std::string no_text(const Json&) {
  return {};
}

Expected<void> upload(const Options& options, const Session& session) {
  if (const auto checked = check_inputs(options.inputs); !checked) return checked;
  return print(session, upload_volume(session, options.inputs.front(), options.query), id_text);
}

Expected<void> volumes(const Options& options, const Session& session) {
  return print(session, session.api.volumes(options.query), volumes_text);
}

Expected<void> submit(const Options& options, const Session& session) {
  if (const auto method = find_method(session.api, options.order.method); !method)
    return tl::unexpected(method.error());
  return print(session, session.api.submit(order_document(options.order, options.id)), id_text);
}

Expected<void> jobs(const Options& options, const Session& session) {
  return print(session, session.api.jobs(options.query), jobs_text);
}

/// An id does not say of what it is: the failure when it is neither a job's nor a volume's.
Failure neither(const std::string& id, const Failure& failure) {
  if (failure.code != ExitCode::kNoInput) return failure;
  return {failure.code, "There is no job or volume " + printable(id) + ", or no longer.", failure.problem};
}

Expected<void> show(const Options& options, const Session& session) {
  const auto job = session.api.job(options.id);
  if (job || job.error().code != ExitCode::kNoInput) return print(session, job, job_text);
  const auto volume = session.api.volume(options.id);
  if (!volume) return tl::unexpected(neither(options.id, volume.error()));
  return print(session, volume, volume_text);
}

Expected<void> wait(const Options& options, const Session& session) {
  const auto job = wait_for_end(session, options.id, "");
  const auto printed = print(session, job, no_text);
  return printed ? outcome_of(*job) : printed;
}

Expected<void> cancel(const Options& options, const Session& session) {
  return print(session, session.api.cancel(options.id), no_text);
}

Expected<void> fetch(const Options& options, const Session& session) {
  auto job = session.api.job(options.id);
  if (!job) return tl::unexpected(job.error());
  if (const auto outcome = outcome_of(*job); !outcome) return outcome;
  const auto folder = OutputFolder::open(options.output_folder);
  if (!folder) return tl::unexpected(folder.error());
  const auto paths = fetch_results(session, *job, {*folder, options.stem, {}, options.force});
  if (!paths) return tl::unexpected(paths.error());
  for (const std::string& path : *paths) session.console.line(path);
  session.console.document({{"results", job->at("results")}, {"files", *paths}});
  return {};
}

Expected<void> remove(const Options& options, const Session& session) {
  const auto deleted = session.api.delete_job(options.id);
  if (deleted || deleted.error().code != ExitCode::kNoInput) return deleted;
  const auto volume_deleted = session.api.delete_volume(options.id);
  if (!volume_deleted) return tl::unexpected(neither(options.id, volume_deleted.error()));
  return {};
}

Expected<void> methods(const Options&, const Session& session) {
  return print(session, session.api.methods(), catalogue_text);
}

struct CommandRow {
  std::string_view name;
  Expected<void> (*run)(const Options&, const Session&);
};

constexpr CommandRow kCommands[] = {{"smooth", smooth}, {"upload", upload},  {"volumes", volumes},
                                    {"submit", submit}, {"jobs", jobs},      {"show", show},
                                    {"wait", wait},     {"cancel", cancel},  {"fetch", fetch},
                                    {"delete", remove}, {"methods", methods}};

}  // namespace

Expected<void> run_command(const Options& options, const Session& session) {
  for (const CommandRow& row : kCommands) {
    if (row.name == options.command) return row.run(options, session);
  }
  throw std::logic_error("a command without a row in the table");
}

}  // namespace volsmooth
