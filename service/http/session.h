#pragma once

#include <boost/asio/awaitable.hpp>
#include <chrono>
#include <memory>
#include <optional>

#include "service/http/body_receiver.h"
#include "service/http/connection.h"
#include "service/http/handlers.h"
#include "service/http/handshake_limit.h"
#include "service/http/host_check.h"
#include "service/http/log.h"
#include "service/http/routes.h"
#include "service/http/server.h"
#include "service/http/thread_pool.h"
#include "service/http/wake.h"
#include "service/jobs/refusal_rows.h"

namespace volsmooth {

/// What the sessions of a server share; belongs to the I/O thread, as all of a session does.
struct SessionContext {
  const ServerSettings& settings;
  Api api;
  HostNames hosts;
  BodyRules body_rules;
  ThreadPool& reading;  ///< for looks at the store: milliseconds
  ThreadPool& writing;  ///< for steps of the store, each with its fsync: nobody who only looks waits for them
  ThreadPool& bulk;     ///< for the bytes of files: as slow as the disk
  ThreadPool& auditing;   ///< for rows of the audit; many, since those that wait together share an fsync
  ThreadPool& verifying;  ///< for handlers that were given a file: seconds
  std::shared_ptr<const TlsIdentity> tls = {};  ///< of new connections; none: they are in the clear
  RefusalRows unknown_callers = {};             ///< of those who have no right to be known
  HandshakeLimit handshakes = {};
  bool stopping = false;
};

/// Serves the requests of one connection, in order.
class Session {
 public:
  /// `peer`: who calls, for the limit of handshakes.
  Session(Socket socket, std::string peer, SessionContext& context);

  boost::asio::awaitable<void> run();

  /// Ends what is under way by a token that does not hold any more.
  void tokens_changed();

  /// Since when it waits for a request or the rest of its head; none: it is at work.
  std::optional<std::chrono::steady_clock::time_point> waiting_since() const {
    return made_way_ ? std::nullopt : waiting_since_;
  }
  /// Ends it while it waits, without a word.
  void make_way();

  /// Ends a wait for a request or for news; lets an answer that is under way finish.
  void wind_down();

 private:
  /// One request on its way through.
  struct Exchange {
    Request request;
    const Route* route = nullptr;
    RequestRecord record;
    bool keep_alive = false;
  };
  template <typename T>
  using Awaitable = boost::asio::awaitable<T>;

  /// Runs `work`, which returns an expected value, on a pool; what it throws becomes a problem.
  template <typename Work>
  Awaitable<std::invoke_result_t<Work>> run_guarded(ThreadPool& pool, const Exchange& exchange, Work work) {
    return pool.run([this, &exchange, work]() -> std::invoke_result_t<Work> {
      try {
        return work();
      } catch (const std::exception& error) {
        return tl::unexpected(fault(exchange, error));
      }
    });
  }
  Problem fault(const Exchange& exchange, const std::exception& error) const;

  Awaitable<bool> serve_one();
  Awaitable<void> serve(Exchange& exchange);
  Awaitable<void> handle(Exchange& exchange, std::unique_ptr<BodyReceiver> receiver);
  double patience_with_strangers() const;
  Awaitable<void> refuse_unread(Exchange& exchange, Problem problem);
  Awaitable<tl::expected<void, Problem>> receive_body(Exchange& exchange, BodyReceiver& receiver);

  tl::expected<void, Problem> admit(Exchange& exchange) const;
  /// Whether what its token allowed at the beginning still is: unauthenticated.
  tl::expected<void, Problem> check_current(const Exchange& exchange) const;

  static Actor actor_of(const Exchange& exchange);
  Awaitable<void> send(Exchange& exchange, Reply reply);
  Awaitable<Reply> audited(Exchange& exchange, Reply reply);
  Awaitable<bool> send_file(Exchange& exchange, const FileBody& body);
  Awaitable<bool> send_events(Exchange& exchange, EventStream& stream);
  Awaitable<Reply> wait_for(Exchange& exchange, LongPoll& poll, Response head);
  Awaitable<bool> write(Exchange& exchange, std::string_view bytes);

  void tell_news();  ///< wakes it while it waits for them

  Connection connection_;
  const std::string peer_;
  SessionContext& context_;
  const Exchange* serving_ = nullptr;
  bool idle_ = false;
  bool made_way_ = false;
  std::optional<std::chrono::steady_clock::time_point> waiting_since_ = std::chrono::steady_clock::now();
  bool unread_ = false;  ///< whether the peer may still be sending what nobody will read
  bool writing_ = false;
  std::shared_ptr<Wake> wake_;  ///< while it waits for news
};

}  // namespace volsmooth
