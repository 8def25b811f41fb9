#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <functional>
#include <memory>

namespace volsmooth {

/// Lets a coroutine of the I/O thread sleep until there is news or the time is over. News that comes while
/// nobody sleeps is kept.
class Wake : public std::enable_shared_from_this<Wake> {
 public:
  explicit Wake(boost::asio::any_io_executor executor) : timer_(std::move(executor)) {}

  void wake() {
    news_ = true;
    timer_.cancel();
  }

  /// Wakes it from any thread, as long as it exists.
  std::function<void()> waker() {
    return [sleeper = weak_from_this(), executor = timer_.get_executor()] {
      boost::asio::post(executor, [sleeper] {
        if (const auto self = sleeper.lock()) self->wake();
      });
    };
  }

  boost::asio::awaitable<void> sleep_until(std::chrono::steady_clock::time_point end) {
    if (!news_) {
      timer_.expires_at(end);
      co_await timer_.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
    }
    news_ = false;
  }

 private:
  boost::asio::steady_timer timer_;
  bool news_ = false;
};

}  // namespace volsmooth
