#include "service/jobs/expiry.h"

namespace volsmooth {
namespace {

constexpr auto kTombstonesKept = std::chrono::days(400);

}  // namespace

void Expiry::forget_expired() {
  // Jobs first: a volume that waits for its last job to end may go in the same round.
  for (const std::string& id : jobs_.expired())
    if (!stopping_) remove_.job(id);
  for (const VolumeStore::Owned& volume : volumes_.expired())
    if (!stopping_) remove_.volume(volume);
  if (!stopping_) remove_.arrivals();
  database_.forget_tombstones(database_.now() - kTombstonesKept);
  keys_.forget_old();
  database_.clear_log();
}

}  // namespace volsmooth
