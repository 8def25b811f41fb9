#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/jobs/job_service.h"
#include "service/jobs/store_database.h"
#include "service/jobs/stored_files.h"

namespace volsmooth {

/// A stretch of a stored file that is one DICOM instance.
struct ArrivedPart {
  std::string file;  ///< its name below the data directory
  std::int64_t offset = 0, bytes = 0;
};

/// Rows of the instances that devices sent to a preset: they wait until their series is whole, belong to its
/// job from then on, and go when the job has its volume, is cancelled or deleted. Thread-safe; throws
/// DatabaseError.
class ArrivalStore {
 public:
  explicit ArrivalStore(StoreDatabase& database) : database_(database) {}

  /// One that waits already stays as it is, but its series is not quiet: devices send again what they had no
  /// answer for. False: all were such, and nothing is in the file that is not in others. `also` is done in
  /// the same transaction.
  bool add(
      std::string_view tenant, std::string_view preset, const FileRecord& file,
      const std::vector<ArrivedInstance>& instances,
      const std::function<void(Database&)>& also = [](Database&) {});

  /// Series of that preset of which nothing has arrived since, and whose they are: of each tenant the oldest.
  struct QuietSeries {
    DicomSource source;
    std::string tenant;
  };
  std::vector<QuietSeries> quiet_since(const std::string& preset, Time since);

  std::vector<ArrivedPart> parts_of(std::string_view job_id);
  /// `forget_arrivals`, in a transaction of its own.
  std::vector<std::string> forget(std::string_view job_id);

  /// Forgets series that still wait, such as for a preset that is not in the configuration any more, and of
  /// which nothing has come since; returns the files that are nobody's any more.
  std::vector<std::string> forget_waiting(Time since);

  std::vector<std::string> files();  ///< those that a row points to

 private:
  StoreDatabase& database_;
};

/// What has arrived of a series is that job's from now on; part of the transaction that inserts it.
void hand_over(Database& database, const ArrivalStore::QuietSeries& series, std::string_view job_id);

/// Forgets the instances of a job, likewise; returns the files that are nobody's any more.
std::vector<std::string> forget_arrivals(Database& database, std::string_view job_id);

/// What a job's arrivals take; of the disk, and of what its tenant keeps.
std::int64_t bytes_of_arrivals(Database& database, std::string_view job_id);

/// A new place for an arriving file below the data directory.
std::string new_arrival_file();

}  // namespace volsmooth
