#include "service/http/server.h"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <charconv>
#include <future>
#include <stdexcept>
#include <thread>
#include <unordered_set>

#include "service/http/ascii.h"
#include "service/http/metrics.h"
#include "service/http/problem_types.h"
#include "service/http/session.h"
#include "service/jobs/tokens.h"

namespace volsmooth {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::local::stream_protocol;
using boost::system::error_code;

constexpr std::string_view kUnixPrefix = "unix:";
constexpr int kReadingThreads = 4;
constexpr int kWritingThreads = 16;  // what they store together waits for the disk once
constexpr int kBulkThreads = 4;
constexpr int kAuditingThreads = 32;
constexpr int kVerifyingThreads = 2;
constexpr auto kGrace = std::chrono::seconds(5);
constexpr auto kPauseAfterAcceptFailure = std::chrono::milliseconds(100);
constexpr int kAcceptedAtOnce = 64;
constexpr int kUnsentBytes = 1 << 18;

[[noreturn]] void fail(const std::string& sentence) {
  throw std::runtime_error(sentence);
}

/// What is written goes out at once, and the kernel takes no more than goes out: crowds that read nothing of
/// large answers would have it keep gigabytes for them. A Unix socket has neither option.
void send_at_once(Socket& socket) {
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytes, sizeof kUnsentBytes);
}

tcp::endpoint endpoint_of(const std::string& listen) {
  const auto colon = listen.rfind(':');
  if (colon == std::string::npos) fail("--listen takes ADDRESS:PORT or unix:PATH, such as 127.0.0.1:8742");
  std::string address = listen.substr(0, colon);
  if (address.starts_with('[') && address.ends_with(']')) address = address.substr(1, address.size() - 2);
  if (address == "localhost") address = "127.0.0.1";
  unsigned short port = 0;
  const char* const end = listen.data() + listen.size();
  const auto number = std::from_chars(listen.data() + colon + 1, end, port);
  error_code bad_address;
  const auto ip = asio::ip::make_address(address, bad_address);
  if (bad_address || number.ec != std::errc() || number.ptr != end)
    fail("--listen takes an IP address and a port from 0 to 65535, such as 127.0.0.1:8742");
  return {ip, port};
}

/// Why everyone who reaches an address may not be let in; empty: they may.
std::string exposure(const ServerSettings& settings, const Api& api) {
  if (settings.tls_certificate.empty())
    return "without TLS, whoever is on the way could read tokens and volumes. Add --tls-cert and --tls-key";
  if (!api.jobs.tokens().needed())
    return "without access tokens, everyone who reaches that address could read and delete the volumes. Make "
           "one with volsmoothd token create, or add --require-tokens";
  return {};
}

tcp::acceptor listen_on(asio::io_context& io, const tcp::endpoint& endpoint, const std::string& exposed) {
  if (!endpoint.address().is_loopback() && !exposed.empty())
    fail("refusing to listen on " + endpoint.address().to_string() + ": " + exposed +
         "; or listen on 127.0.0.1, or add --allow-open-network when something in front of it does the "
         "checking.");
  try {
    return {io, endpoint, true};
  } catch (const boost::system::system_error& error) {
    fail("cannot listen on " + endpoint.address().to_string() + " port " + std::to_string(endpoint.port()) +
         ": " + error.code().message());
  }
}

/// Whatever else is at `path`, such as somebody's file, stays.
void remove_socket(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::symlink_status(path, ignored).type() == std::filesystem::file_type::socket)
    std::filesystem::remove(path, ignored);
}

/// Removes the socket that a daemon left behind when it was killed; a living one keeps its own.
void remove_stale_socket(asio::io_context& io, const std::filesystem::path& path) {
  std::error_code ignored;
  const auto found = std::filesystem::symlink_status(path, ignored);
  if (std::filesystem::exists(found) && found.type() != std::filesystem::file_type::socket)
    fail("cannot listen on the Unix socket " + path.string() +
         ": something that is not a socket is there already. Give another path, or remove it yourself.");
  stream_protocol::socket probe(io);
  error_code answer;
  probe.connect(stream_protocol::endpoint(path.string()), answer);
  if (answer == asio::error::connection_refused) remove_socket(path);
}

stream_protocol::acceptor listen_on(asio::io_context& io, const std::filesystem::path& path) {
  try {
    remove_stale_socket(io, path);
    stream_protocol::acceptor acceptor(io, stream_protocol::endpoint(path.string()));
    std::filesystem::permissions(path,
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    return acceptor;
  } catch (const boost::system::system_error& error) {
    fail("cannot listen on the Unix socket " + path.string() + ": " + error.code().message());
  }
}

std::shared_ptr<const TlsIdentity> identity_of(const ServerSettings& settings) {
  if (settings.tls_certificate.empty() && settings.tls_key.empty()) return nullptr;
  if (settings.tls_certificate.empty() || settings.tls_key.empty())
    fail("--tls-cert and --tls-key go together");
  if (settings.listen.starts_with(kUnixPrefix)) fail("a Unix socket needs no TLS");
  return std::make_shared<const TlsIdentity>(settings.tls_certificate, settings.tls_key);
}

}  // namespace

struct Server::State {
  State(ServerSettings given, Api api)
      : settings(std::move(given)), context{settings, api,     {},   body_rules(settings, api),
                                            reading,  writing, bulk, auditing,
                                            verifying} {
    context.tls = identity_of(settings);
    for (const auto& name : settings.host_names) context.hosts.names.push_back(lowered(name));
    listen();
    api.jobs.tokens().on_change([this] {
      asio::post(io, [this] {
        for (Session* session : sessions) session->tokens_changed();
      });
    });
    thread = std::jthread([this] { io.run(); });
  }

  static BodyRules body_rules(const ServerSettings& settings, Api api) {
    return {settings.max_upload_bytes,
            [api](const Caller& caller, std::optional<std::int64_t> declared, bool may_be_repeated) {
              return api.jobs.begin_upload(caller, declared, may_be_repeated);
            }};
  }

  void listen() {
    if (settings.listen.starts_with(kUnixPrefix)) {
      socket_path = settings.listen.substr(kUnixPrefix.size());
      address = settings.listen;
      serve(listen_on(io, socket_path));
    } else {
      auto acceptor = listen_on(io, endpoint_of(settings.listen),
                                settings.allow_open_network ? "" : exposure(settings, context.api));
      const auto bound = acceptor.local_endpoint();
      const auto ip = bound.address().to_string();
      const auto host = bound.address().is_v6() ? "[" + ip + "]" : ip;
      if (!bound.address().is_unspecified()) context.hosts.names.push_back(host);
      address = (context.tls ? "https://" : "http://") + host + ":" + std::to_string(bound.port());
      serve(std::move(acceptor));
    }
  }

  template <typename Acceptor>
  void serve(Acceptor acceptor) {
    auto shared = std::make_shared<Acceptor>(std::move(acceptor));
    close_acceptor = [shared] {
      error_code ignored;
      shared->close(ignored);
    };
    asio::co_spawn(io, accept_all(shared), asio::detached);
  }

  template <typename Acceptor>
  asio::awaitable<void> accept_all(std::shared_ptr<Acceptor> acceptor) {
    acceptor->non_blocking(true);
    while (acceptor->is_open()) {
      auto [error, accepted] = co_await acceptor->async_accept(asio::as_tuple(asio::use_awaitable));
      // Before others have their turn again, so that whoever comes last does not wait for a turn of theirs
      // for each one before him.
      for (int taken = 1; !error; ++taken) {
        begin_guarded(Socket(std::move(accepted)));
        if (taken == kAcceptedAtOnce) break;
        accepted = acceptor->accept(error);
      }
      if (error && error != asio::error::would_block && acceptor->is_open()) {
        if (error == asio::error::no_descriptors) make_room();
        co_await asio::steady_timer(io, kPauseAfterAcceptFailure).async_wait(asio::use_awaitable);
      }
    }
  }

  /// One connection that cannot be served must not end the loop that accepts all others.
  void begin_guarded(Socket socket) {
    try {
      begin(std::move(socket));
    } catch (const std::exception& error) {
      log_fault("", "", error.what());
    }
  }

  void begin(Socket socket) {
    if (context.stopping) return;
    error_code ignored, gone;
    const auto peer = socket.remote_endpoint(gone);
    if (gone) return;
    const std::string caller = address_of(*peer.data());
    if (context.tls && context.api.jobs.tokens().needed() && !context.handshakes.admit(caller))
      return context.api.metrics.handshake_refused();
    send_at_once(socket);
    if (sessions.size() >= static_cast<std::size_t>(settings.max_connections) && !make_room()) {
      if (context.tls) return;  // a handshake would take what there is too little of
      socket.non_blocking(true, ignored);
      socket.write_some(
          asio::buffer(refusal({"too-many-connections", "All connections are taken; try again later."})),
          ignored);
      return;
    }
    auto session = std::make_shared<Session>(std::move(socket), caller, context);
    sessions.insert(session.get());
    asio::co_spawn(io, session->run(),
                   [this, session](std::exception_ptr fault) { end(session.get(), fault); });
  }

  /// Of those that want nothing yet, the one that has wanted it longest goes. False: all are at work.
  bool make_room() {
    Session* longest = nullptr;
    for (Session* session : sessions)
      if (session->waiting_since() && (!longest || session->waiting_since() < longest->waiting_since()))
        longest = session;
    if (longest) longest->make_way();
    return longest != nullptr;
  }

  void end(Session* session, const std::exception_ptr& fault) {
    sessions.erase(session);
    try {
      if (fault) std::rethrow_exception(fault);
    } catch (const std::exception& error) {
      log_fault("", "", error.what());
    }
    if (context.stopping && sessions.empty()) all_ended.set_value();
  }

  void wind_down() {
    context.stopping = true;
    close_acceptor();
    if (sessions.empty()) return all_ended.set_value();
    for (Session* session : sessions) session->wind_down();
  }

  void reload_tls() {
    const auto fresh = identity_of(settings);
    asio::post(io, [this, fresh] { context.tls = fresh; });
  }

  void stop() {
    if (!thread.joinable()) return;
    context.api.jobs.tokens().on_change({});
    asio::post(io, [this] { wind_down(); });
    all_ended.get_future().wait_for(kGrace);
    io.stop();
    thread.join();
    if (!socket_path.empty()) remove_socket(socket_path);
  }

  ServerSettings settings;
  SessionContext context;
  std::string address;
  std::filesystem::path socket_path;
  std::unordered_set<Session*> sessions;
  std::promise<void> all_ended;
  asio::io_context io{1};
  std::function<void()> close_acceptor;  // gone before the I/O context, which the acceptor needs
  // Gone before the I/O context: their threads hand results to it.
  ThreadPool reading{kReadingThreads, ThreadPool::Priority::kNormal};
  ThreadPool writing{kWritingThreads, ThreadPool::Priority::kNormal};
  ThreadPool bulk{kBulkThreads, ThreadPool::Priority::kNormal};
  ThreadPool auditing{kAuditingThreads, ThreadPool::Priority::kNormal};
  ThreadPool verifying{kVerifyingThreads, ThreadPool::Priority::kLow};
  std::jthread thread;
};

Server::Server(ServerSettings settings, Api api)
    : state_(std::make_unique<State>(std::move(settings), api)) {}
Server::~Server() {
  stop();
}
const std::string& Server::address() const {
  return state_->address;
}
void Server::reload_tls() {
  state_->reload_tls();
}
void Server::stop() {
  state_->stop();
}

}  // namespace volsmooth
