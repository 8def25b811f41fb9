#include "service/http/answers.h"
#include "service/http/entity_tag.h"
#include "service/http/file_reply.h"
#include "service/http/handlers.h"
#include "service/http/idempotency.h"
#include "service/http/query_values.h"
#include "service/jobs/job_json.h"

namespace volsmooth {
namespace {

UploadOptions upload_options(const QueryValues& query) {
  UploadOptions options;
  if (const auto index = number_in(query, "volume_index"))
    options.volume_index = static_cast<std::int64_t>(*index);
  options.non_finite = number_in(query, "non_finite");
  options.series = text_in(query, "series");
  options.resample = text_in(query, "resample");
  return options;
}

}  // namespace

Reply post_volume(Api& api, Request& request) {
  std::string wanted = "volume " + request.file->finish();
  for (const auto& [name, value] : request.query) wanted += " " + name + "=" + value;
  const auto first = [&](const std::optional<RequestKey>& key) {
    return api.jobs.keep_volume(request.caller, std::move(*request.file), upload_options(request.query), key);
  };
  const auto again = [&](const std::string& id) { return api.jobs.volume(request.caller, id); };
  return once(api.jobs, request, wanted, first, again).map([](const StoredVolume& volume) {
    return created(to_json(volume), 201, "/v1/volumes/" + volume.id);
  });
}

Reply get_volumes(Api& api, Request& request) {
  VolumeQuery wanted{.cursor = text_in(request.query, "cursor")};
  if (const auto limit = number_in(request.query, "limit")) wanted.limit = static_cast<int>(*limit);
  return api.jobs.volumes(request.caller, wanted).map([](const VolumePage& page) {
    return page_response("volumes", page.volumes, page.next_cursor,
                         [](const StoredVolume& volume) { return to_json(volume); });
  });
}

Reply get_volume(Api& api, Request& request) {
  return api.jobs.volume(request.caller, request.path["id"]).map([&](const StoredVolume& volume) {
    return tagged_response(request, to_json(volume), entity_tag(volume));
  });
}

Reply get_volume_content(Api& api, Request& request) {
  return api.jobs.volume_content(request.caller, request.path["id"]).and_then([&](const StoredFile& file) {
    return reply_with_file(request, file);
  });
}

Reply delete_volume(Api& api, Request& request) {
  // A volume never changes, so nothing can come between the look and the step but its end.
  if (const auto found = api.jobs.volume(request.caller, request.path["id"]);
      found && !if_match_holds(request.head, entity_tag(*found)))
    return tl::unexpected(has_changed());
  return api.jobs.delete_volume(request.caller, request.path["id"]).map([] { return Response{204}; });
}

}  // namespace volsmooth
