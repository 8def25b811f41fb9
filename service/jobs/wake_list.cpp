#include "service/jobs/wake_list.h"

#include <vector>

namespace volsmooth {

struct WakeList::Listener {
  std::recursive_mutex mutex;  // recursive: a call may drop its own handle
  std::function<void()> wake;
  bool wanted = true;
};

std::shared_ptr<void> WakeList::add(std::string_view job_id, std::function<void()> wake) {
  auto listener = std::make_shared<Listener>();
  listener->wake = std::move(wake);
  const std::lock_guard lock(listeners_->mutex);
  const auto place = listeners_->by_job.emplace(job_id, listener);
  return {listener.get(), [listeners = listeners_, listener, place](void*) {
            {
              const std::lock_guard call(listener->mutex);
              listener->wanted = false;
            }
            const std::lock_guard list(listeners->mutex);
            listeners->by_job.erase(place);
          }};
}

void WakeList::wake(const std::string& job_id) {
  std::vector<std::shared_ptr<Listener>> called;
  {
    const std::lock_guard lock(listeners_->mutex);
    const auto [first, last] = listeners_->by_job.equal_range(job_id);
    for (auto entry = first; entry != last; ++entry) called.push_back(entry->second);
  }
  for (const auto& listener : called) {
    const std::lock_guard lock(listener->mutex);
    if (listener->wanted) listener->wake();
  }
}

}  // namespace volsmooth
