#pragma once

#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "service/jobs/job_service.h"
#include "service/jobs/store_database.h"

namespace volsmooth {

/// Rows of deliveries and of their instances. A delivery comes into being with the success of its job, in the
/// same transaction, so none is lost and none is made twice. Thread-safe; throws DatabaseError.
class DeliveryStore {
 public:
  explicit DeliveryStore(StoreDatabase& database) : database_(database) {}

  struct Due {
    std::string job_id;
    std::string destination;
    int tries = 0;
    Time since;  ///< when it became pending
  };
  /// The pending delivery that has waited longest among those whose time has come and that are not in
  /// `but_not`.
  std::optional<Due> next_due(Time now, const std::set<std::string>& but_not);

  void expect(std::string_view job_id, std::span<const DicomInstance> instances);  ///< repeatable
  std::vector<DicomInstance> pending(std::string_view job_id);
  void record(std::string_view job_id, std::span<const InstanceAnswer> answers);

  void postpone(std::string_view job_id, Time until, const Problem& why);
  /// Delivered when every instance is stored, else failed for `why`.
  void finish(std::string_view job_id, const std::optional<Problem>& why);
  bool retry(std::string_view job_id);  ///< of a failed one; false: there is none

  std::vector<LedgerEntry> ledger(std::string_view job_id);

 private:
  StoreDatabase& database_;
};

/// Part of the transaction that makes the job succeed.
void insert_delivery(Database& database, std::string_view job_id, std::string_view destination, Time now);
std::optional<Delivery> delivery_of(Database& database, std::int64_t job_sequence);

}  // namespace volsmooth
