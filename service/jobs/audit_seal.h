#pragma once

#include <filesystem>
#include <optional>

#include "service/jobs/audit_log.h"
#include "service/storage/posix.h"

namespace volsmooth {

/// The head of the audit in a file of its own, so that rows that are missing at its end are missed. It is
/// written after each commit, without waiting for the disk: after a power cut it may be an earlier one, which
/// still has to be on the way.
class AuditSeal {
 public:
  /// Beside the database; created when missing.
  explicit AuditSeal(const std::filesystem::path& database_file);

  const AuditHead& last() const { return last_; }
  void write(const AuditHead& head);  ///< not at the same time as others

  /// What is in the file; none: nothing was sealed yet.
  static std::optional<AuditHead> read(const std::filesystem::path& database_file);

 private:
  const FileDescriptor file_;
  AuditHead last_;
};

}  // namespace volsmooth
