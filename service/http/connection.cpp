#include "service/http/connection.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/chunk_encode.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/write.hpp>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <sstream>

#include "service/http/body_decoder.h"
#include "service/http/problem_types.h"

namespace volsmooth {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);

constexpr std::size_t kReadBytes = 65536;
constexpr double kDiscardSeconds = 2;
constexpr auto kCancelAgain = std::chrono::milliseconds(100);
constexpr char kTlsHandshake = 0x16;  ///< the first byte of a TLS connection (RFC 8446, 5.1)

/// A block is given up when it takes so many times longer than may pass without a byte of it: otherwise a
/// byte now and then would hold a connection, and what it has reserved, for ever.
constexpr double kSlownessAllowed = 10;

std::chrono::steady_clock::duration in_seconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(seconds));
}

/// Such as "Sun, 06 Nov 1994 08:49:37 GMT"; the process never leaves the C locale.
std::string http_date(std::time_t time) {
  std::tm utc{};
  ::gmtime_r(&time, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &utc)};
}

std::string_view text_of(const beast::flat_buffer& buffer) {
  return {static_cast<const char*>(buffer.data().data()), buffer.size()};
}

}  // namespace

/// Cancels what the socket waits for when the time is over, for as long as it lives. A read that is complete
/// by then, but not yet seen, cannot be cancelled: a loop of reads asks `expired` before each of them.
class Connection::Deadline {
 public:
  Deadline(Connection& connection, double seconds)
      : Deadline(connection, std::chrono::steady_clock::now() + in_seconds(seconds)) {}
  Deadline(Connection& connection, std::chrono::steady_clock::time_point end) : connection_(connection) {
    arm(connection, expired_, end);
  }
  ~Deadline() { connection_.timer_.cancel(); }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  bool expired() const { return *expired_; }
  ReadFailure failure() const { return expired() ? ReadFailure::kTimeout : ReadFailure::kClosed; }

 private:
  /// Again and again: a TLS operation is several of the socket, and the end of one may just be on its way.
  static void arm(Connection& connection, std::weak_ptr<bool> armed,
                  std::chrono::steady_clock::time_point end) {
    connection.timer_.expires_at(end);
    connection.timer_.async_wait([armed, &connection](error_code cancelled) {
      const auto expired = armed.lock();
      if (cancelled || !expired) return;
      *expired = true;
      connection.cancel();
      arm(connection, armed, std::chrono::steady_clock::now() + kCancelAgain);
    });
  }

  Connection& connection_;
  std::shared_ptr<bool> expired_ = std::make_shared<bool>(false);
};

/// The deadlines of the steps in which one block goes over.
class Connection::BlockDeadline {
 public:
  explicit BlockDeadline(double seconds_per_step)
      : step_(in_seconds(seconds_per_step)), end_(now() + in_seconds(kSlownessAllowed * seconds_per_step)) {}
  bool expired() const { return now() >= end_; }
  std::chrono::steady_clock::time_point of_next_step() const { return std::min(now() + step_, end_); }

 private:
  static std::chrono::steady_clock::time_point now() { return std::chrono::steady_clock::now(); }
  const std::chrono::steady_clock::duration step_;
  const std::chrono::steady_clock::time_point end_;
};

struct Connection::Codec {
  beast::flat_buffer received{kReadBytes};
  std::size_t head_bytes = 0;
  BodyDecoder body{Head{}};
};

Connection::Connection(Socket socket, const TlsIdentity* identity)
    : socket_(std::move(socket)),
      tls_(identity ? std::make_unique<TlsStream>(socket_, *identity) : nullptr),
      timer_(socket_.get_executor()),
      codec_(std::make_unique<Codec>()) {
  codec_->received.reserve(kReadBytes);
}

Connection::~Connection() = default;

asio::awaitable<TlsStream::Outcome> Connection::read_some(asio::mutable_buffer into) {
  if (tls_) co_return co_await tls_->read_some(into);
  co_return co_await socket_.async_read_some(into, kAwait);
}

asio::awaitable<TlsStream::Outcome> Connection::write_some(asio::const_buffer from) {
  if (tls_) co_return co_await tls_->write_some(from);
  co_return co_await socket_.async_write_some(from, kAwait);
}

asio::awaitable<bool> Connection::begin(double seconds) {
  if (!tls_) co_return true;
  const Deadline deadline(*this, seconds);
  char first = 0;
  for (ssize_t got = -1; got != 1;) {
    const auto [unreadable] = co_await socket_.async_wait(Socket::wait_read, kAwait);
    got = unreadable ? 0 : ::recv(socket_.native_handle(), &first, 1, MSG_PEEK | MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) co_return false;
  }
  if (first == kTlsHandshake) co_return !co_await tls_->handshake();
  tls_.reset();
  const std::string answer =
      refusal({"bad-header", "This port speaks TLS: write https:// in place of http://."});
  co_await write(answer, kDiscardSeconds);
  co_await close_gently();
  co_return false;
}

asio::awaitable<bool> Connection::wait_for_request(double seconds) {
  auto& received = codec_->received;
  if (received.size() > 0) co_return true;
  const Deadline deadline(*this, seconds);
  const auto [error, count] = co_await read_some(received.prepare(kMaxHeadBytes + 1));
  received.commit(count);
  co_return !error;
}

asio::awaitable<tl::expected<std::string_view, ReadFailure>> Connection::read_head(double seconds) {
  auto& received = codec_->received;
  const Deadline deadline(*this, seconds);
  for (;;) {
    const auto text = text_of(received);
    const auto end = head_end(text);
    if (end || text.size() > kMaxHeadBytes) {
      codec_->head_bytes = end.value_or(text.size());
      co_return text.substr(0, codec_->head_bytes);
    }
    if (deadline.expired()) co_return tl::unexpected(ReadFailure::kTimeout);
    const auto wanted = kMaxHeadBytes + 1 - text.size();
    const auto [error, count] = co_await read_some(received.prepare(wanted));
    if (error) co_return tl::unexpected(deadline.failure());
    received.commit(count);
  }
}

bool Connection::begin_body(const Head& head) {
  http::request_parser<http::empty_body> parser;
  parser.header_limit(2 * kMaxHeadBytes);
  parser.body_limit(boost::none);
  error_code error;
  const auto used = parser.put(asio::buffer(codec_->received.data(), codec_->head_bytes), error);
  if (error || used != codec_->head_bytes || parser.chunked() != head.chunked) return false;
  codec_->received.consume(used);
  codec_->body = BodyDecoder(head);
  return true;
}

asio::awaitable<tl::expected<std::string_view, ReadFailure>> Connection::read_body(std::span<char> block,
                                                                                   double seconds_per_read) {
  auto& [received, head_bytes, body] = *codec_;
  const BlockDeadline whole(seconds_per_read);
  std::size_t filled = 0;
  while (!body.done() && filled < block.size()) {
    if (received.size() == 0) {
      if (!reads_) co_return tl::unexpected(ReadFailure::kClosed);
      if (whole.expired()) co_return tl::unexpected(ReadFailure::kTimeout);
      const Deadline deadline(*this, whole.of_next_step());
      const auto [error, count] = co_await read_some(received.prepare(kReadBytes));
      if (error) co_return tl::unexpected(deadline.failure());
      received.commit(count);
    }
    const auto step = body.decode(text_of(received), block.subspan(filled));
    if (!step) co_return tl::unexpected(ReadFailure::kMalformed);
    received.consume(step->taken);
    filled += step->given;
  }
  co_return std::string_view(block.data(), filled);
}

asio::awaitable<bool> Connection::write(std::string_view bytes, double seconds_per_write) {
  const BlockDeadline whole(seconds_per_write);
  while (!bytes.empty()) {
    if (whole.expired()) co_return false;
    const Deadline deadline(*this, whole.of_next_step());
    const auto [error, count] = co_await write_some(asio::buffer(bytes));
    if (error) co_return false;
    bytes.remove_prefix(count);
  }
  co_return true;
}

asio::awaitable<void> Connection::close_gently() {
  error_code ignored;
  const Deadline deadline(*this, kDiscardSeconds);
  if (tls_) co_await tls_->shutdown();
  socket_.shutdown(Socket::shutdown_send, ignored);
  std::vector<char> discarded(kReadBytes);
  for (error_code error; !error && !deadline.expired();)
    std::tie(error, std::ignore) = co_await socket_.async_read_some(asio::buffer(discarded), kAwait);
  socket_.close(ignored);
}

void Connection::on_readable(std::function<void()> notice) {
  socket_.async_wait(Socket::wait_read, [notice = std::move(notice)](error_code cancelled) {
    if (!cancelled) notice();
  });
}

bool Connection::peer_has_closed() {
  if (tls_) {  // what can be read may be its word that it closes
    pollfd state{socket_.native_handle(), POLLRDHUP, 0};
    return ::poll(&state, 1, 0) != 0;
  }
  char byte = 0;
  const auto count = ::recv(socket_.native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  return count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
}

void Connection::cancel() {
  error_code ignored;
  socket_.cancel(ignored);
}

void Connection::stop_reading() {
  reads_ = false;
  cancel();
}

void Connection::break_off() {
  error_code ignored;
  socket_.set_option(asio::socket_base::linger(true, 0), ignored);
  socket_.close(ignored);
}

std::string response_head(int status, const std::vector<HeaderField>& fields) {
  http::response<http::empty_body> response(static_cast<http::status>(status), 11);
  response.set(http::field::date, http_date(std::time(nullptr)));
  for (const auto& field : fields) response.insert(field.name, field.value);
  std::ostringstream text;
  text << response.base();
  return text.str();
}

std::string refusal(const Problem& problem) {
  const std::string document = problem_document(problem).dump();
  const int status = problem_type(problem.slug).status;
  std::vector<HeaderField> fields = {{"Content-Type", "application/problem+json"},
                                     {"Content-Length", std::to_string(document.size())},
                                     {"Connection", "close"}};
  if (status == 503) fields.push_back({"Retry-After", "5"});
  return response_head(status, fields) + document;
}

std::string as_chunk(std::string_view bytes) {
  if (bytes.empty()) return beast::buffers_to_string(http::make_chunk_last());
  return beast::buffers_to_string(http::make_chunk(asio::buffer(bytes)));
}

}  // namespace volsmooth
