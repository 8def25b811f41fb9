#include "service/http/thread_pool.h"

#include <sys/resource.h>
#include <unistd.h>

namespace volsmooth {
namespace {

constexpr int kLowNice = 5;  // between an answer and a computation

void lower_priority() {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kLowNice);
}

}  // namespace

ThreadPool::ThreadPool(int threads, Priority priority) : queue_(threads), work_(queue_.get_executor()) {
  for (int i = 0; i < threads; ++i)
    threads_.emplace_back([this, priority] {
      if (priority == Priority::kLow) lower_priority();
      queue_.run();
    });
}

ThreadPool::~ThreadPool() {
  queue_.stop();
}

boost::asio::awaitable<void> ThreadPool::run_erased(std::function<void()> work) {
  const auto on_thread = [](const std::function<void()>& task) -> boost::asio::awaitable<void> {
    task();
    co_return;
  };
  co_await boost::asio::co_spawn(queue_.get_executor(), on_thread(work), boost::asio::use_awaitable);
}

}  // namespace volsmooth
