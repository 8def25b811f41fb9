#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <functional>
#include <optional>
#include <thread>
#include <vector>

namespace volsmooth {

/// Threads for work that blocks, away from the I/O thread.
class ThreadPool {
 public:
  enum class Priority { kNormal, kLow };
  ThreadPool(int threads, Priority priority);
  ~ThreadPool();  ///< finishes what was begun, drops what was not

  /// Runs `work` on one of the threads while the calling coroutine waits; what it throws comes out here.
  template <typename Work>
  boost::asio::awaitable<std::invoke_result_t<Work>> run(Work work) {
    if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
      co_await run_erased(work);
    } else {
      std::optional<std::invoke_result_t<Work>> result;
      co_await run_erased([&] { result.emplace(work()); });
      co_return std::move(*result);
    }
  }

 private:
  boost::asio::awaitable<void> run_erased(std::function<void()> work);

  boost::asio::io_context queue_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::vector<std::jthread> threads_;
};

}  // namespace volsmooth
