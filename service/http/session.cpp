#include "service/http/session.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "service/http/accept.h"
#include "service/http/authorization.h"
#include "service/http/digest_check.h"
#include "service/http/idempotency.h"
#include "service/http/metrics.h"
#include "service/http/problem_types.h"
#include "service/jobs/ids.h"

namespace volsmooth {
namespace {

constexpr std::size_t kFirstBlockBytes = 16 * 1024;  ///< slow clients hold no more
constexpr std::size_t kBodyBlockBytes = 256 * 1024;
constexpr std::int64_t kMaxDrainedBytes = 65536;

Problem problem_of(ReadFailure failure) {
  if (failure == ReadFailure::kMalformed)
    return {"bad-chunk", "The chunked body does not follow RFC 9112, section 7.1."};
  return {"request-timeout", failure == ReadFailure::kTimeout
                                 ? "The rest of the request did not come in time."
                                 : "The request ended before its body did."};
}

}  // namespace

Session::Session(Socket socket, std::string peer, SessionContext& context)
    : connection_(std::move(socket), context.tls.get()), peer_(std::move(peer)), context_(context) {}

Problem Session::fault(const Exchange& exchange, const std::exception& error) const {
  if (auto full = context_.api.jobs.full_disk(error)) return *std::move(full);
  const auto id = exchange.record.id;
  log_fault(id, exchange.route ? exchange.route->pattern : "", error.what());
  // By contract, the store's failures are the only runtime errors down there.
  if (dynamic_cast<const std::runtime_error*>(&error))
    return {"store-unavailable", "The store failed; try again later.", {{"request", id}}};
  return {"internal", "Something went wrong here; the log says more about this request.", {{"request", id}}};
}

void Session::wind_down() {
  if (idle_) connection_.cancel();
  tell_news();
}

void Session::make_way() {
  made_way_ = true;
  connection_.cancel();
}

void Session::tell_news() {
  if (wake_) wake_->wake();
}

void Session::tokens_changed() {
  if (wake_ && !writing_) return tell_news();  // it looks for itself, and ends as it should
  if (!serving_ || serving_->request.caller.token.empty() || check_current(*serving_)) return;
  const bool answer_has_begun = serving_->record.status != 0;
  answer_has_begun ? connection_.break_off() : connection_.stop_reading();
}

boost::asio::awaitable<void> Session::run() {
  idle_ = true;
  const bool begun = co_await connection_.begin(context_.settings.handshake_seconds);
  idle_ = false;
  for (bool more = begun; more && !context_.stopping;) more = co_await serve_one();
  if (unread_ && !made_way_) co_await connection_.close_gently();
}

Session::Awaitable<bool> Session::serve_one() {
  idle_ = true;
  waiting_since_ = std::chrono::steady_clock::now();
  const bool begun = co_await connection_.wait_for_request(context_.settings.idle_seconds);
  idle_ = false;
  if (!begun) co_return false;

  Exchange exchange;
  exchange.record.id = new_id("r-");
  const auto start = std::chrono::steady_clock::now();
  serving_ = &exchange;
  co_await serve(exchange);
  serving_ = nullptr;
  if (exchange.request.file) co_await context_.bulk.run([&] { exchange.request.file.reset(); });

  auto& record = exchange.record;
  record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  record.method = exchange.request.head.method;
  if (exchange.route) record.route = exchange.route->pattern;
  log_request(record);
  context_.api.metrics.request_done(record.method, record.route, record.status, record.seconds);
  unread_ = !exchange.keep_alive;
  co_return exchange.keep_alive;
}

Session::Awaitable<void> Session::serve(Exchange& exchange) {
  const auto bytes = co_await connection_.read_head(context_.settings.head_seconds);
  waiting_since_.reset();
  made_way_ = false;
  if (!bytes) {
    if (bytes.error() == ReadFailure::kTimeout)
      co_await send(exchange, tl::unexpected(problem_of(bytes.error())));
    co_return;
  }
  auto head = check_head(*bytes);
  if (head && !connection_.begin_body(*head))
    head = tl::unexpected(Problem{"bad-header", "The request head does not follow RFC 9112."});
  if (!head) {
    co_await send(exchange, tl::unexpected(head.error()));
    co_return;
  }
  exchange.request.head = std::move(*head);
  if (auto admitted = admit(exchange); !admitted) {
    co_await refuse_unread(exchange, admitted.error());
    co_return;
  }
  auto receiver = co_await run_guarded(context_.reading, exchange, [&] {
    return receiver_for(exchange.route->body, exchange.request, context_.body_rules)
        .and_then([&](std::unique_ptr<BodyReceiver> made) {
          return with_digest_check(exchange.request.head, std::move(made));
        })
        .and_then([&](std::unique_ptr<BodyReceiver> made) {
          return with_idempotency_key(context_.api.jobs, *exchange.route, exchange.request, std::move(made));
        });
  });
  if (receiver)
    co_await handle(exchange, std::move(*receiver));
  else
    co_await refuse_unread(exchange, receiver.error());
}

/// What can be said from the head alone.
tl::expected<void, Problem> Session::admit(Exchange& exchange) const {
  Request& request = exchange.request;
  if (auto known = check_host(request.head, context_.hosts); !known) return known;
  if (auto own = check_origin(request.head, context_.hosts); !own) return own;
  auto target = parse_target(request.head.target);
  if (!target) return tl::unexpected(target.error());
  auto match = match_route(request.head.method, target->segments);
  if (!match) return tl::unexpected(match.error());
  exchange.route = match->route;
  auto caller = identify(request.head, *exchange.route, context_.api.jobs.tokens());
  if (!caller) return tl::unexpected(caller.error());
  request.caller = std::move(*caller);
  if (!request.caller.token.empty()) context_.handshakes.know(peer_);
  request.path = std::move(match->path);
  if (auto may = authorize(request.caller, *exchange.route); !may) return may;
  request.query = std::move(target->query);
  if (auto checked = check_query(*exchange.route, request.query); !checked) return checked;

  const auto media_type = exchange.route->answer.media_type;
  if (media_type.find('/') != std::string_view::npos && media_type != "*/*" &&
      !accepts(request.head.list("accept"), media_type))
    return tl::unexpected(
        Problem{"not-acceptable", "The answer can only be " + std::string(media_type) + "."});
  return {};
}

Actor Session::actor_of(const Exchange& exchange) {
  const Caller& caller = exchange.request.caller;
  return {caller.tenant, caller.token, exchange.record.id};
}

tl::expected<void, Problem> Session::check_current(const Exchange& exchange) const {
  if (!exchange.route->scope || context_.api.jobs.tokens().is_current(exchange.request.caller)) return {};
  return tl::unexpected(Problem{"unauthenticated", "The token has expired or was revoked meanwhile."});
}

Session::Awaitable<void> Session::handle(Exchange& exchange, std::unique_ptr<BodyReceiver> receiver) {
  Request& request = exchange.request;
  const auto counted = request.file ? context_.api.metrics.upload_begins() : nullptr;
  auto received = co_await receive_body(exchange, *receiver);
  if (!received) {
    co_await send(exchange, tl::unexpected(received.error()));
    co_return;
  }
  exchange.keep_alive = request.head.keep_alive && !context_.stopping;
  auto complete = co_await run_guarded(context_.reading, exchange, [&] { return receiver->finish(); });
  if (!complete) {
    co_await send(exchange, tl::unexpected(complete.error()));
    co_return;
  }
  const bool gives_files = exchange.route->answer.media_type == "*/*";  // which are opened and checked first
  ThreadPool& pool = request.file                      ? context_.verifying
                     : gives_files                     ? context_.bulk
                     : exchange.route->method == "GET" ? context_.reading
                                                       : context_.writing;
  auto reply = co_await run_guarded(pool, exchange, [&]() -> Reply {
    if (auto current = check_current(exchange); !current) return tl::unexpected(current.error());
    const ActingFor caller(actor_of(exchange));
    return exchange.route->handle(context_.api, request);
  });
  co_await send(exchange, std::move(reply));
}

/// For a body that nobody needs or that comes from somebody unknown: whoever trickles it must not hold the
/// connection.
double Session::patience_with_strangers() const {
  constexpr double kSeconds = 0.5;
  return std::min(context_.settings.body_seconds, kSeconds);
}

/// Answers before the body was read; a small one is then skipped to keep the connection.
Session::Awaitable<void> Session::refuse_unread(Exchange& exchange, Problem problem) {
  const Head& head = exchange.request.head;
  const bool small =
      !head.chunked && !head.expects_continue && head.content_length.value_or(0) <= kMaxDrainedBytes;
  exchange.keep_alive = small && head.keep_alive && !context_.stopping;
  co_await send(exchange, tl::unexpected(std::move(problem)));
  std::vector<char> skipped(kMaxDrainedBytes);
  while (exchange.keep_alive) {
    const auto bytes = co_await connection_.read_body(skipped, patience_with_strangers());
    exchange.keep_alive = bytes.has_value();
    if (bytes && bytes->empty()) break;
  }
}

Session::Awaitable<tl::expected<void, Problem>> Session::receive_body(Exchange& exchange,
                                                                      BodyReceiver& receiver) {
  const Head& head = exchange.request.head;
  if (head.expects_continue && head.has_body() &&
      !co_await connection_.write("HTTP/1.1 100 Continue\r\n\r\n", context_.settings.write_seconds))
    co_return tl::unexpected(problem_of(ReadFailure::kClosed));

  const auto wanted =
      std::min<std::int64_t>(head.content_length.value_or(kFirstBlockBytes), kFirstBlockBytes);
  std::vector<char> block(static_cast<std::size_t>(head.has_body() ? wanted : 1));
  ThreadPool& pool = exchange.request.file ? context_.bulk : context_.reading;
  for (;;) {
    const auto bytes = co_await connection_.read_body(
        block, exchange.route->scope ? context_.settings.body_seconds : patience_with_strangers());
    if (auto current = check_current(exchange); !current) co_return current;
    if (!bytes) co_return tl::unexpected(problem_of(bytes.error()));
    if (bytes->empty()) co_return tl::expected<void, Problem>();
    exchange.record.bytes_in += static_cast<std::int64_t>(bytes->size());
    auto taken = co_await run_guarded(pool, exchange, [&] { return receiver.receive(*bytes); });
    if (!taken) co_return taken;
    if (bytes->size() == block.size()) block.resize(std::min(2 * block.size(), kBodyBlockBytes));
  }
}

}  // namespace volsmooth
