#include "service/http/answers.h"
#include "service/http/entity_tag.h"
#include "service/http/file_reply.h"
#include "service/http/handlers.h"
#include "service/http/idempotency.h"
#include "service/http/problem_types.h"
#include "service/http/query_values.h"
#include "service/jobs/job_json.h"
#include "service/jobs/strict_json.h"

namespace volsmooth {
namespace {

constexpr double kDefaultPage = 50;

nlohmann::json document_of(const Job& job) {
  auto document = to_json(job);
  if (job.error) document["error"] = problem_document(*job.error);
  if (job.delivery && job.delivery->error)
    document["delivery"]["error"] = problem_document(*job.delivery->error);
  return document;
}

/// The document, or as much of it as concerns one who may bring jobs but not see what becomes of them.
nlohmann::json document_for(const Caller& caller, const Job& job) {
  if (caller.may(Scope::kRead)) return document_of(job);
  return {{"id", job.id}, {"state", name_of(job.state)}};
}

nlohmann::json results_of(const Job& job) {
  auto documents = nlohmann::json::array();
  for (const auto& result : job.results) documents.push_back(to_json(result));
  return documents;
}

tl::expected<Job, Problem> submit_text(Api& api, Request& request) {
  return parse_json(request.text).and_then(order_from).and_then([&](const JobOrder& order) {
    return once(
        api.jobs, request, "job " + to_json(order).dump(),
        [&](const std::optional<RequestKey>& key) { return api.jobs.submit(request.caller, order, key); },
        [&](const std::string& id) { return api.jobs.job(request.caller, id); });
  });
}

/// A volume that is deleted again unless a job takes it.
class VolumeForAJob {
 public:
  VolumeForAJob(JobService& jobs, const Caller& caller, std::string id)
      : jobs_(jobs), caller_(caller), id_(std::move(id)) {}
  ~VolumeForAJob() {
    if (taken_) return;
    try {
      (void)jobs_.delete_volume(caller_, id_);
    } catch (const std::exception&) {  // the store that failed the job has failed again
    }
  }
  VolumeForAJob(const VolumeForAJob&) = delete;
  VolumeForAJob& operator=(const VolumeForAJob&) = delete;

  void taken() { taken_ = true; }

 private:
  JobService& jobs_;
  const Caller& caller_;
  std::string id_;
  bool taken_ = false;
};

/// Keeps the volume of a form and submits the order for it; leaves no volume behind without a job.
tl::expected<Job, Problem> submit_volume(Api& api, Request& request, nlohmann::json document,
                                         const std::optional<RequestKey>& key) {
  const auto volume = api.jobs.keep_volume(request.caller, std::move(*request.file), {});
  if (!volume) return tl::unexpected(volume.error());
  VolumeForAJob unclaimed(api.jobs, request.caller, volume->id);
  if (document.is_object()) document["volume"] = volume->id;
  auto job = order_from(document).and_then(
      [&](const JobOrder& order) { return api.jobs.submit(request.caller, order, key); });
  if (job) unclaimed.taken();
  return job;
}

tl::expected<Job, Problem> submit_form(Api& api, Request& request) {
  const auto document = parse_json(request.text);
  if (!document) return tl::unexpected(document.error());
  if (document->is_object() && document->contains("volume"))
    return tl::unexpected(
        Problem{"unknown-field", "Beside an uploaded volume, the job names none.", {{"field", "volume"}}});
  return once(
      api.jobs, request, "form " + request.file->finish() + " " + document->dump(),
      [&](const std::optional<RequestKey>& key) { return submit_volume(api, request, *document, key); },
      [&](const std::string& id) { return api.jobs.job(request.caller, id); });
}

/// What is kept of an event has the problem as the jobs know it.
std::string data_of(const JobEvent& event) {
  if (event.kind != "state") return event.data;
  auto data = nlohmann::json::parse(event.data);
  if (data.contains("error")) data["error"] = completed_problem(std::move(data["error"]));
  return data.dump();
}

/// RFC: https://html.spec.whatwg.org/multipage/server-sent-events.html#event-stream-interpretation
std::string as_event(const JobEvent& event) {
  return "id: " + event.id + "\nevent: " + event.kind + "\ndata: " + data_of(event) + "\n\n";
}

Subscribe subscribe_to(Api& api, const std::string& id) {
  return [&api, id](std::function<void()> wake) { return api.jobs.subscribe(id, std::move(wake)); };
}

/// The events after `last_id`, which moves on with them.
tl::expected<EventStream::Batch, Problem> next_events(Api& api, const Caller& caller, const std::string& id,
                                                      std::string& last_id) {
  // Looked at first: when the job is final here, all of its events are there below.
  const auto job = api.jobs.job(caller, id);
  if (!job) return tl::unexpected(job.error());
  const auto events = api.jobs.events_after(caller, id, last_id);
  if (!events) return tl::unexpected(events.error());
  EventStream::Batch batch{{}, is_final(job->state)};
  for (const auto& event : *events) batch.text += as_event(event);
  if (!events->empty()) last_id = events->back().id;
  return batch;
}

}  // namespace

Reply post_job(Api& api, Request& request) {
  return (request.file ? submit_form(api, request) : submit_text(api, request)).map([&](const Job& job) {
    return created(document_for(request.caller, job), 202, "/v1/jobs/" + job.id);
  });
}

Reply get_jobs(Api& api, Request& request) {
  const auto& query = request.query;
  const JobQuery wanted{
      job_state_from(text_in(query, "state")), text_in(query, "method"), text_in(query, "label"),
      static_cast<int>(number_in(query, "limit").value_or(kDefaultPage)), text_in(query, "cursor")};
  return api.jobs.jobs(request.caller, wanted).map([](const JobPage& page) {
    return page_response("jobs", page.jobs, page.next_cursor, document_of);
  });
}

Reply get_job(Api& api, Request& request) {
  const std::string id = request.path["id"];
  const auto wait = number_in(request.query, "wait").value_or(0);
  if (wait == 0)
    return api.jobs.job(request.caller, id).map([&](const Job& job) {
      const auto document = document_of(job);
      return tagged_response(request, document, entity_tag(document.dump()));
    });

  const auto ask = [&api, caller = request.caller, id] {
    return api.jobs.job(caller, id).map([](const Job& job) {
      return LongPoll::Answer{document_of(job).dump(), is_final(job.state)};
    });
  };
  const auto patience = std::chrono::milliseconds(static_cast<std::int64_t>(1000 * wait));
  return Response{200, {{"Cache-Control", "no-store"}}, LongPoll{subscribe_to(api, id), patience, ask}};
}

Reply get_job_events(Api& api, Request& request) {
  const std::string id = request.path["id"];
  std::string last_id(request.head.header("last-event-id"));
  return api.jobs.events_after(request.caller, id, last_id).map([&](const auto&) {
    const auto next = [&api, caller = request.caller, id, last_id]() mutable {
      return next_events(api, caller, id, last_id);
    };
    return Response{200, {{"Cache-Control", "no-store"}}, EventStream{subscribe_to(api, id), next}};
  });
}

Reply cancel_job(Api& api, Request& request) {
  return api.jobs.cancel(request.caller, request.path["id"]).map([&](const Job& job) {
    return json_response(document_for(request.caller, job), 202);
  });
}

Reply delete_job(Api& api, Request& request) {
  const auto is_wanted = [&](const Job& job) {
    return if_match_holds(request.head, entity_tag(document_of(job).dump()));
  };
  return api.jobs.delete_job(request.caller, request.path["id"], is_wanted)
      .and_then([](bool deleted) -> Reply {
        if (!deleted) return tl::unexpected(has_changed());
        return Response{204};
      });
}

Reply get_results(Api& api, Request& request) {
  return api.jobs.job(request.caller, request.path["id"]).map([](const Job& job) {
    return json_response({{"results", results_of(job)}});
  });
}

Reply get_result(Api& api, Request& request) {
  return api.jobs.result(request.caller, request.path["id"], request.path["name"])
      .and_then([&](const StoredFile& file) { return reply_with_file(request, file); });
}

Reply get_delivery(Api& api, Request& request) {
  return api.jobs.ledger(request.caller, request.path["id"]).map([](const std::vector<LedgerEntry>& ledger) {
    auto documents = nlohmann::json::array();
    for (const auto& entry : ledger) documents.push_back(to_json(entry));
    return json_response({{"instances", documents}});
  });
}

Reply deliver_again(Api& api, Request& request) {
  return api.jobs.deliver_again(request.caller, request.path["id"]).map([&](const Job& job) {
    return json_response(document_for(request.caller, job), 202);
  });
}

}  // namespace volsmooth
