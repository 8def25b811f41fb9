#pragma once

#include "service/http/message.h"
#include "service/jobs/job_service.h"

namespace volsmooth {

class Metrics;

/// What the handlers work with.
struct Api {
  JobService& jobs;
  Metrics& metrics;
};

Reply post_volume(Api& api, Request& request);
Reply get_volumes(Api& api, Request& request);
Reply get_volume(Api& api, Request& request);
Reply get_volume_content(Api& api, Request& request);
Reply delete_volume(Api& api, Request& request);

Reply post_job(Api& api, Request& request);
Reply get_jobs(Api& api, Request& request);
Reply get_job(Api& api, Request& request);
Reply get_job_events(Api& api, Request& request);
Reply cancel_job(Api& api, Request& request);
Reply delete_job(Api& api, Request& request);
Reply get_results(Api& api, Request& request);
Reply get_result(Api& api, Request& request);
Reply get_delivery(Api& api, Request& request);
Reply deliver_again(Api& api, Request& request);

Reply post_studies(Api& api, Request& request);

Reply get_methods(Api& api, Request& request);
Reply get_formats(Api& api, Request& request);
Reply get_healthz(Api& api, Request& request);
Reply get_readyz(Api& api, Request& request);
Reply get_metrics(Api& api, Request& request);
Reply get_openapi(Api& api, Request& request);

}  // namespace volsmooth
