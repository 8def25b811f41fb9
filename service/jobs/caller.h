#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace volsmooth {

/// What a caller may do. Admin covers the others.
enum class Scope {
  kRead,    ///< look: documents, files, events
  kSubmit,  ///< bring and end: uploads, jobs, cancelling, deleting
  kAdmin,   ///< also what concerns all tenants, such as metrics
};

/// Who has everything to whom nothing else was said: rows from before there were tenants, and all calls as
/// long as no tokens are needed.
inline constexpr const char* kDefaultTenant = "default";

/// Who asks. Volumes and jobs belong to a tenant; what is another tenant's is for a caller as if it had never
/// been, whatever the scopes.
struct Caller {
  std::string tenant;
  std::string token;  ///< the name of the token, never its secret; empty: none was needed
  std::vector<Scope> scopes;

  /// Whoever calls when no tokens are needed.
  static Caller anyone() { return {kDefaultTenant, "", {Scope::kAdmin}}; }

  bool may(Scope scope) const {
    return std::ranges::any_of(scopes, [&](Scope held) { return held == scope || held == Scope::kAdmin; });
  }
};

}  // namespace volsmooth
