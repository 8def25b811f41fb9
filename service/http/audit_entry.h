#pragma once

#include <optional>

#include "service/http/routes.h"
#include "service/jobs/audit_log.h"

namespace volsmooth {

/// What the audit is to say of an answer beside what the store says of its own changes: that bytes of a file
/// go out, that something that would have changed or taken data was refused, that somebody had no right.
/// None: nothing. `route` is null when none matched.
std::optional<AuditEntry> audit_entry(const Route* route, const Request& request, const Reply& reply);

}  // namespace volsmooth
