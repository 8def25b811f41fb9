#include "service/jobs/source_runner.h"

#include <spdlog/spdlog.h>

#include <span>

#include "service/jobs/arrival_store.h"
#include "service/jobs/ids.h"
#include "service/jobs/job_runner.h"
#include "service/jobs/refused.h"
#include "service/jobs/retry_times.h"

namespace volsmooth {
namespace {

NodeFailure no_room() {
  return {{"insufficient-storage", "The disk has too little free space for the series."}, true};
}

NodeFailure failure_of(const std::exception& thrown) {
  if (dynamic_cast<const DamagedFile*>(&thrown))
    return {{"integrity-failure", "What has arrived of the series is damaged; send it again."}, false};
  if (is_of_full_disk(thrown)) return no_room();
  return {{"internal", "The series could not be fetched; the fault is the service's, see its log."}, false};
}

}  // namespace

void SourceRunner::run(ClaimedJob& claim) const {
  try {
    // Before an archive is asked for what could not be kept.
    database_.read([&](Database& database) {
      require_room_(database, claim.job().tenant, 0, 0);
      return true;
    });
    auto file = files_.receive();
    if (!file) return fail_or_wait(claim, no_room());
    if (auto volume = retrieve(claim, *file)) {
      keep(claim, *std::move(volume), *std::move(file));
    } else {
      fail_or_wait(claim, std::move(volume.error()));
    }
  } catch (const Cancelled&) {
    claim.end_interrupted();
  } catch (const Refused& refused) {  // until something was deleted, or has expired
    fail_or_wait(claim, {refused.problem, true});
  } catch (const std::exception& thrown) {
    spdlog::error("job {} attempt {}: {}", claim.job().id, claim.job().attempt, thrown.what());
    fail_or_wait(claim, failure_of(thrown));
  }
}

tl::expected<StoredVolume, NodeFailure> SourceRunner::retrieve(ClaimedJob& claim, IncomingFile& file) const {
  const DicomSource& source = claim.job().order.source.value();
  RunningJob& running = claim.running();
  const Progress report = [&](double fraction) {
    if (running.report("retrieve", fraction)) wake_(claim.job().id);
  };
  report(0);
  if (!source.preset.empty()) {
    assemble(claim, file, report);
  } else if (auto came = pacs_.retrieve(claim.job().tenant, source, file, report); !came) {
    return tl::unexpected(std::move(came.error()));
  }

  StoredVolume volume;
  volume.id = new_id("v-");
  volume.tenant = claim.job().tenant;
  volume.options.series = source.series;
  volume.sha256 = file.finish();
  volume.block_sums = file.block_sums();
  volume.bytes = file.bytes();
  volume.created_at = database_.now();
  if (settings_.keep.count() > 0) volume.expires_at = volume.created_at + settings_.keep;
  auto facts = engine_.inspect(file.path(), volume.options, [&](double) { running.throw_if_interrupted(); });
  if (!facts) {
    const bool is_passing = facts.error().is_passing;
    return tl::unexpected(NodeFailure{std::move(facts.error()), is_passing});
  }
  volume.facts = *std::move(facts);
  return volume;
}

/// Puts what has arrived into one multipart body.
void SourceRunner::assemble(ClaimedJob& claim, IncomingFile& file, const Progress& report) const {
  const std::string boundary = "volsmooth-" + new_id("");
  const auto write = [&](const std::string& text) { file.write(std::as_bytes(std::span(text))); };
  const auto parts = ArrivalStore(database_).parts_of(claim.job().id);
  for (std::size_t part = 0; part < parts.size(); ++part) {
    report(static_cast<double>(part) / static_cast<double>(parts.size()));
    const auto& [name, offset, bytes] = parts[part];
    write("--" + boundary + "\r\nContent-Type: application/dicom\r\n\r\n");
    const auto stored = StoredFiles(database_, files_).open(name);
    if (!stored || offset + bytes > (*stored)->bytes()) throw DamagedFile();
    std::vector<std::byte> content(static_cast<std::size_t>(bytes));
    (*stored)->read(offset, content);
    file.write(content);
    write("\r\n");
  }
  write("--" + boundary + "--\r\n");
}

void SourceRunner::keep(ClaimedJob& claim, StoredVolume volume, IncomingFile file) const {
  auto plan = engine_.plan(claim.job().order, volume.facts);
  if (!plan) return claim.fail(std::move(plan.error()));
  const std::string place = volume_file(volume.id);
  files_.adopt(std::move(file), place);
  bool taken = false;
  try {
    const std::int64_t bytes = volume.bytes, to_come = plan->disk_bytes;
    // What devices sent goes when its volume is there.
    const auto check_room = [&](Database& database) {
      const std::int64_t arrived = bytes_of_arrivals(database, claim.job().id);
      require_room_(database, claim.job().tenant, bytes - arrived, to_come);
    };
    taken = claim.continue_with({std::move(volume), *std::move(plan), check_room});
  } catch (...) {
    if (!database_.condemned()) files_.remove(place);
    throw;
  }
  if (!taken) files_.remove(place);
}

void SourceRunner::fail_or_wait(ClaimedJob& claim, NodeFailure failure) const {
  const Time now = database_.now();
  if (!failure.is_passing || now - claim.job().created_at > settings_.node_patience)
    return claim.fail(std::move(failure.problem));
  claim.wait_until(now + pause_after(claim.job().source_tries, settings_.longest_node_pause),
                   std::move(failure.problem));
}

}  // namespace volsmooth
