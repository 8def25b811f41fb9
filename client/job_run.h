#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/api.h"
#include "client/console.h"
#include "client/output_folder.h"
#include "client/progress_bar.h"
#include "client/quantities.h"

namespace volsmooth {

/// What every command works with.
struct Session {
  Api& api;
  const Console& console;
  const Interruption& interruption;
  bool server_is_private = false;  ///< nobody else will ask for what is on it
};

/// Sends a file and passes the server's warnings on.
Expected<nlohmann::json> upload_volume(const Session& session, const std::filesystem::path& input,
                                       const Query& query);

/// Waits until the job is final and gives its document. `what` names it in the progress bar. A server that
/// goes away meanwhile gets half a minute to come back, as jobs outlive it.
Expected<nlohmann::json> wait_for_end(const Session& session, const std::string& id, const std::string& what);

/// Nothing for a succeeded job; for another why it has no results: kBadData or kInternal as its problem says,
/// kInterrupted if cancelled, kTryLater if it has not ended.
Expected<void> outcome_of(const nlohmann::json& job);

struct Fetching {
  const OutputFolder& folder;
  std::string stem;  ///< empty: results keep the server's names
  std::vector<Isovalue> isovalues = {};
  bool overwrite = false;
};

/// Downloads all results of a job and checks their sizes and sums; only when all are there they get their
/// names. Gives the paths.
Expected<std::vector<std::string>> fetch_results(const Session& session, const nlohmann::json& job,
                                                 const Fetching& fetching);

/// "stem_name", or the name alone.
std::string file_name(const std::string& stem, const std::string& name);

}  // namespace volsmooth
