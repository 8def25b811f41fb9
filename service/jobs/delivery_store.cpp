#include "service/jobs/delivery_store.h"

#include "service/jobs/stored_json.h"

namespace volsmooth {
namespace {

using nlohmann::json;

DeliveryState delivery_state_from(std::string_view name) {
  for (const DeliveryState state : {DeliveryState::kPending, DeliveryState::kDelivered})
    if (name == name_of(state)) return state;
  return DeliveryState::kFailed;
}

/// A name of the configuration.
std::string destination_of(Database& database, std::string_view job_id) {
  Statement row = database.query(
      "SELECT destination FROM deliveries WHERE job = (SELECT sequence FROM jobs WHERE id = ?)", job_id);
  return row.step() ? row.text(0) : std::string();
}

}  // namespace

std::string_view name_of(DeliveryState state) {
  switch (state) {
    case DeliveryState::kPending:
      return "pending";
    case DeliveryState::kDelivered:
      return "delivered";
    default:
      return "failed";
  }
}

std::optional<DeliveryStore::Due> DeliveryStore::next_due(Time now, const std::set<std::string>& but_not) {
  return database_.read([&](Database& database) -> std::optional<Due> {
    Statement row = database.query(
        "SELECT jobs.id, destination, tries, since_ms FROM deliveries JOIN jobs ON jobs.sequence = job "
        "WHERE deliveries.state = 'pending' AND next_ms <= ? ORDER BY next_ms, job",
        milliseconds_of(now));
    while (row.step()) {
      if (but_not.contains(row.text(0))) continue;
      return Due{row.text(0), row.text(1), static_cast<int>(row.integer(2)), time_of(row.integer(3))};
    }
    return std::nullopt;
  });
}

void DeliveryStore::expect(std::string_view job_id, std::span<const DicomInstance> instances) {
  database_.write([&](Database& database) {
    int new_ones = 0;
    for (const DicomInstance& instance : instances)
      new_ones += database.run(
          "INSERT OR IGNORE INTO delivered_instances (job, sop_instance_uid, sop_class_uid, result, state, "
          "reason) "
          "SELECT sequence, ?2, ?3, ?4, 'pending', '' FROM jobs WHERE id = ?1",
          job_id, instance.sop_instance_uid, instance.sop_class_uid, instance.result);
    if (new_ones > 0) audit(database, job_id, "sending to " + destination_of(database, job_id));
    return true;
  });
}

std::vector<LedgerEntry> DeliveryStore::ledger(std::string_view job_id) {
  return database_.read([&](Database& database) {
    return all_of(
        database.query(
            "SELECT sop_class_uid, sop_instance_uid, result, state, reason FROM delivered_instances "
            "WHERE job = (SELECT sequence FROM jobs WHERE id = ?) ORDER BY result, rowid",
            job_id),
        [](const Statement& row) {
          return LedgerEntry{{row.text(0), row.text(1), row.text(2)}, row.text(3), row.text(4)};
        });
  });
}

std::vector<DicomInstance> DeliveryStore::pending(std::string_view job_id) {
  std::vector<DicomInstance> instances;
  for (LedgerEntry& entry : ledger(job_id))
    if (entry.state == "pending") instances.push_back(std::move(entry.instance));
  return instances;
}

void DeliveryStore::record(std::string_view job_id, std::span<const InstanceAnswer> answers) {
  database_.write_at_any_rate([&](Database& database) {
    for (const InstanceAnswer& answer : answers)
      database.run(
          "UPDATE delivered_instances SET state = ?3, reason = ?4 "
          "WHERE job = (SELECT sequence FROM jobs WHERE id = ?1) AND sop_instance_uid = ?2",
          job_id, answer.sop_instance_uid, answer.stored ? "stored" : "refused", answer.reason);
    return true;
  });
}

void DeliveryStore::postpone(std::string_view job_id, Time until, const Problem& why) {
  database_.write_at_any_rate([&](Database& database) {
    return database.run(
        "UPDATE deliveries SET tries = tries + 1, next_ms = ?2, error = ?3 "
        "WHERE job = (SELECT sequence FROM jobs WHERE id = ?1) AND state = 'pending'",
        job_id, milliseconds_of(until), problem_to_stored_json(why).dump());
  });
}

void DeliveryStore::finish(std::string_view job_id, const std::optional<Problem>& why) {
  database_.write_at_any_rate([&](Database& database) {
    std::optional<std::string> error;
    if (why) error = problem_to_stored_json(*why).dump();
    const DeliveryState state = why ? DeliveryState::kFailed : DeliveryState::kDelivered;
    const bool was_pending =
        database.run(
            "UPDATE deliveries SET state = ?2, error = ?3 "
            "WHERE job = (SELECT sequence FROM jobs WHERE id = ?1) AND state = 'pending'",
            job_id, name_of(state), error) > 0;
    if (!was_pending) return false;  // it was deleted with its job
    const std::string action =
        (why ? "delivery failed to " : "delivered to ") + destination_of(database, job_id);
    audit(database, AuditEntry{action, std::string(job_id), why ? why->slug : "done"});
    return true;
  });
}

bool DeliveryStore::retry(std::string_view job_id) {
  return database_.write([&](Database& database) {
    const std::int64_t now = milliseconds_of(database_.now());
    const bool failed = database.run(
                            "UPDATE deliveries SET state = 'pending', next_ms = ?2, since_ms = ?2 "
                            "WHERE job = (SELECT sequence FROM jobs WHERE id = ?1) AND state = 'failed'",
                            job_id, now) > 0;
    if (!failed) return false;
    database.run(
        "UPDATE delivered_instances SET state = 'pending', reason = '' "
        "WHERE job = (SELECT sequence FROM jobs WHERE id = ?) AND state = 'refused'",
        job_id);
    audit(database, job_id, "delivery to be tried again to " + destination_of(database, job_id));
    return true;
  });
}

void insert_delivery(Database& database, std::string_view job_id, std::string_view destination, Time now) {
  database.run(
      "INSERT INTO deliveries (job, destination, state, tries, next_ms, since_ms) "
      "SELECT sequence, ?2, 'pending', 0, ?3, ?3 FROM jobs WHERE id = ?1",
      job_id, destination, milliseconds_of(now));
}

std::optional<Delivery> delivery_of(Database& database, std::int64_t job_sequence) {
  Statement row = database.query(
      "SELECT destination, state, tries, next_ms, error, "
      "(SELECT count(*) FROM delivered_instances AS i WHERE i.job = d.job), "
      "(SELECT count(*) FROM delivered_instances AS i WHERE i.job = d.job AND i.state = 'stored'), "
      "(SELECT count(*) FROM delivered_instances AS i WHERE i.job = d.job AND i.state = 'refused') "
      "FROM deliveries AS d WHERE job = ?",
      job_sequence);
  if (!row.step()) return std::nullopt;
  Delivery delivery;
  delivery.destination = row.text(0);
  delivery.state = delivery_state_from(row.text(1));
  delivery.tries = static_cast<int>(row.integer(2));
  if (delivery.state == DeliveryState::kPending && delivery.tries > 0)
    delivery.next_attempt_at = time_of(row.integer(3));
  if (!row.is_null(4)) delivery.error = problem_from_stored_json(json::parse(row.text(4)));
  delivery.instances = row.integer(5);
  delivery.stored = row.integer(6);
  delivery.refused = row.integer(7);
  return delivery;
}

}  // namespace volsmooth
