#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <filesystem>
#include <memory>
#include <tuple>

namespace volsmooth {

/// TCP or Unix, all the same: one instantiation of Beast serves both.
using Socket = boost::asio::generic::stream_protocol::socket;

/// A server's certificate chain and key (PEM), as the files were when it was made, and the rules of its
/// connections: TLS 1.3, or 1.2 with ECDHE and an AEAD; HTTP/1.1.
class TlsIdentity {
 public:
  /// Throws std::runtime_error with a sentence that says what to change.
  TlsIdentity(const std::filesystem::path& certificate, const std::filesystem::path& key);
  ~TlsIdentity();

 private:
  friend class TlsStream;
  struct State;
  std::unique_ptr<State> state_;
};

/// The server's end of TLS on a socket, which it does not own; the one place that knows Asio's templates for
/// it. Its calls are ended like those of the socket.
class TlsStream {
 public:
  TlsStream(Socket& socket, const TlsIdentity& identity);
  ~TlsStream();

  using Outcome = std::tuple<boost::system::error_code, std::size_t>;
  boost::asio::awaitable<boost::system::error_code> handshake();
  boost::asio::awaitable<Outcome> read_some(boost::asio::mutable_buffer into);
  boost::asio::awaitable<Outcome> write_some(boost::asio::const_buffer from);
  boost::asio::awaitable<void> shutdown();  ///< tells the peer that no more comes, and waits for the same

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volsmooth
