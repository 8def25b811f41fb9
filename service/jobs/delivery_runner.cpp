#include "service/jobs/delivery_runner.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>

#include "service/jobs/retry_times.h"

namespace volsmooth {
namespace {

bool holds_instances(const Result& result) {
  return result.kind == "series" || result.kind == "dicom";
}

Problem refused_problem(std::int64_t refused) {
  return {"delivery-refused",
          "The destination refused some of the instances; GET .../delivery lists them with its reasons.",
          {{"refused", refused}}};
}

NodeFailure failure_of_sending(const std::exception& thrown) {
  if (is_of_full_disk(thrown))
    return {{"insufficient-storage", "The disk is too full to keep what the destination answers."}, true};
  return {{"internal", "The results could not be sent; the fault is the service's, see its log."}, false};
}

}  // namespace

WorkerPool::Work DeliveryRunner::claim() {
  const std::lock_guard lock(mutex_);
  if (stopping_) return {};
  auto due = deliveries_.next_due(database_.now(), sending_);
  if (!due) return {};
  sending_.insert(due->job_id);
  return [this, due = *std::move(due)] { run(due); };
}

void DeliveryRunner::run(const DeliveryStore::Due& due) {
  const auto end_sending = [this](const std::string* job_id) {
    const std::lock_guard lock(mutex_);
    sending_.erase(*job_id);
  };
  const std::unique_ptr<const std::string, decltype(end_sending)> sending(&due.job_id, end_sending);
  try {
    settle(due, send(due));
  } catch (const Cancelled&) {  // the next start goes on, unless there is nothing left to be sent
    return;
  } catch (const std::exception& thrown) {
    spdlog::error("delivery of job {}: {}", due.job_id, thrown.what());
    settle(due, tl::unexpected(failure_of_sending(thrown)));
  }
  wake_(due.job_id);
}

tl::expected<void, NodeFailure> DeliveryRunner::send(const DeliveryStore::Due& due) {
  const auto job = jobs_.find(due.job_id);
  if (!job) throw Cancelled();  // deleted meanwhile, and the delivery with it
  const auto place = files_.path_of(results_directory(*job));
  // Asked for every packet, by any thread; the store is not.
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kLook{100};
  std::atomic<Clock::time_point> next_look{};
  const auto keep_going = [&] {
    if (stopping_) throw Cancelled();
    const auto now = Clock::now();
    if (now < next_look.load()) return;
    next_look = now + kLook;
    if (!jobs_.is_wanted(due.job_id)) throw Cancelled();
  };
  std::vector<DicomInstance> all;
  for (const Result& result : job->results) {
    if (!holds_instances(result)) continue;
    if (!stored_files_.check(results_directory(*job) + "/" + result.name, keep_going))
      return tl::unexpected(NodeFailure{
          {"integrity-failure", "A stored result is damaged and is not sent; run the job again."}, false});
    for (DicomInstance& instance : pacs_.instances_in(place / result.name)) {
      instance.result = result.name;
      all.push_back(std::move(instance));
    }
  }
  deliveries_.expect(due.job_id, all);

  const auto record = [&](std::span<const InstanceAnswer> answers) {
    deliveries_.record(due.job_id, answers);
    wake_(due.job_id);
    keep_going();
  };
  const std::vector<DicomInstance> pending = deliveries_.pending(due.job_id);
  for (auto first = pending.begin(); first != pending.end();) {
    const auto last = std::find_if(first, pending.end(),
                                   [&](const DicomInstance& other) { return other.result != first->result; });
    auto sent = pacs_.send(job->tenant, due.destination, place / first->result, std::span(first, last),
                           record, keep_going);
    if (!sent) return sent;
    first = last;
  }
  return {};
}

void DeliveryRunner::settle(const DeliveryStore::Due& due, const tl::expected<void, NodeFailure>& sent) {
  const Time now = database_.now();
  if (!sent) {
    const Problem& problem = sent.error().problem;
    if (sent.error().is_passing && now - due.since < settings_.node_patience) {
      spdlog::warn("delivery of job {} waits: {}", due.job_id, problem.slug);
      deliveries_.postpone(due.job_id, now + pause_after(due.tries, settings_.longest_node_pause), problem);
    } else {
      spdlog::error("delivery of job {} failed: {}", due.job_id, problem.slug);
      deliveries_.finish(due.job_id, problem);
    }
    return;
  }
  const auto ledger = deliveries_.ledger(due.job_id);
  const auto refused = std::ranges::count(ledger, "refused", &LedgerEntry::state);
  if (refused > 0) {
    deliveries_.finish(due.job_id, refused_problem(refused));
  } else {
    deliveries_.finish(due.job_id, std::nullopt);
  }
}

}  // namespace volsmooth
