#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

namespace volsmooth {

/// Who wants to hear of which job. Thread-safe; the handles may outlive the list.
class WakeList {
 public:
  /// `wake` is called until the handle is dropped and not once after that.
  std::shared_ptr<void> add(std::string_view job_id, std::function<void()> wake);
  void wake(const std::string& job_id);

 private:
  struct Listener;
  struct Listeners {
    std::mutex mutex;
    std::multimap<std::string, std::shared_ptr<Listener>> by_job;
  };
  std::shared_ptr<Listeners> listeners_ = std::make_shared<Listeners>();
};

}  // namespace volsmooth
