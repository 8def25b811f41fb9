#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/jobs/job.h"
#include "service/storage/incoming_file.h"

namespace volsmooth {

/// Where instances that devices send go: what the service can do, as plain functions.
struct Inbox {
  std::function<tl::expected<IncomingFile, Problem>()> begin;
  /// Gives what was in the file when that is durable. Thread-safe; may take its time.
  std::function<tl::expected<std::vector<ArrivedInstance>, Problem>(const std::string& preset, IncomingFile)>
      keep;
  std::int64_t max_bytes = 0;  ///< of an instance
};

/// Instances that come by C-STORE one after the other, each piece by piece. The first that goes wrong with
/// one decides its status.
class Arrivals {
 public:
  explicit Arrivals(const Inbox& inbox) : inbox_(inbox) {}

  void take(std::string_view bytes);
  /// Ends the instance: the status for the C-STORE response (DICOM PS3.4, B.2.3), when it is durable or
  /// refused. The UIDs are those of the command.
  std::uint16_t keep(const std::string& preset, const std::string& sop_class,
                     const std::string& sop_instance);

 private:
  void write(std::string_view bytes);

  const Inbox& inbox_;
  std::optional<IncomingFile> file_;
  std::optional<std::uint16_t> refused_;
};

/// The status that says a problem of the service's.
std::uint16_t status_of(const Problem& problem);

}  // namespace volsmooth
