#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "service/http/head_check.h"
#include "service/http/tls_stream.h"

namespace volsmooth {

enum class ReadFailure { kClosed, kTimeout, kMalformed };

/// The bytes of one connection, each wait with its deadline: heads as they came, bodies without their
/// framing, and what is written. Used from the I/O thread.
class Connection {
 public:
  /// With an identity it speaks TLS.
  explicit Connection(Socket socket, const TlsIdentity* identity = nullptr);
  ~Connection();

  /// Whether the peer can be spoken with: with TLS, by a handshake within `seconds`. Who speaks in the clear
  /// is told so.
  boost::asio::awaitable<bool> begin(double seconds);

  /// Whether the next request began within `seconds`.
  boost::asio::awaitable<bool> wait_for_request(double seconds);

  /// The bytes of a head as `head_end` cuts them; they stay until `begin_body`.
  boost::asio::awaitable<tl::expected<std::string_view, ReadFailure>> read_head(double seconds);

  /// Goes on from the head to its body; false if Beast reads the head in another way than `head` does.
  bool begin_body(const Head& head);

  /// The next bytes of the body in `block`: as many as it holds, fewer at the end, then none. All of them in
  /// ten times the time that each read has.
  boost::asio::awaitable<tl::expected<std::string_view, ReadFailure>> read_body(std::span<char> block,
                                                                                double seconds_per_read);

  /// Whether all of it was taken; each part of it within `seconds_per_write`, the whole in ten times that.
  boost::asio::awaitable<bool> write(std::string_view bytes, double seconds_per_write);

  /// Closes so that the peer sees what was written even while it still sends (RFC 9112, 9.6).
  boost::asio::awaitable<void> close_gently();

  /// Calls `notice` once when the peer sends something or closes, until `cancel`.
  void on_readable(std::function<void()> notice);
  bool peer_has_closed();
  void cancel();  ///< ends the wait under way

  void stop_reading();  ///< no more of a body comes: the read under way ends, and those after it
  void break_off();     ///< at once, with what was written and has not gone out yet

  boost::asio::any_io_executor executor() { return socket_.get_executor(); }

 private:
  class Deadline;
  class BlockDeadline;
  struct Codec;
  boost::asio::awaitable<TlsStream::Outcome> read_some(boost::asio::mutable_buffer into);
  boost::asio::awaitable<TlsStream::Outcome> write_some(boost::asio::const_buffer from);

  Socket socket_;
  std::unique_ptr<TlsStream> tls_;  ///< none: in the clear
  boost::asio::steady_timer timer_;
  bool reads_ = true;
  std::unique_ptr<Codec> codec_;
};

/// The status line and the fields of a response, ending in an empty line.
std::string response_head(int status, const std::vector<HeaderField>& fields);

/// The last answer on a connection that is given up before a request of it was understood.
std::string refusal(const Problem& problem);

/// `bytes` as one chunk of a chunked body; no bytes: its end.
std::string as_chunk(std::string_view bytes);

}  // namespace volsmooth
