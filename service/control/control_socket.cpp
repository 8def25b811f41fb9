#include "service/control/control_socket.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace volsmooth {
namespace {

constexpr const char* kName = "control.sock";
constexpr std::size_t kMaxRequestBytes = 65536;
constexpr time_t kPatienceSeconds = 10;
constexpr int kLookMilliseconds = 200;  ///< between two looks at whether to stop
constexpr int kWaiting = 16;

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("control socket: " + what + ": " + std::generic_category().message(errno));
}

Descriptor open_folder(const std::filesystem::path& folder) {
  return Descriptor(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
}

Descriptor new_socket() {
  Descriptor made(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!made) fail("socket");
  return made;
}

sockaddr_un address_in(const Descriptor& folder) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = "/proc/self/fd/" + std::to_string(folder.get()) + "/" + kName;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return address;
}

const sockaddr* as_sockaddr(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

void set_patience(const Descriptor& socket) {
  const timeval patience{kPatienceSeconds, 0};
  for (const int direction : {SO_RCVTIMEO, SO_SNDTIMEO})
    ::setsockopt(socket.get(), SOL_SOCKET, direction, &patience, sizeof patience);
}

bool send_all(const Descriptor& socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

/// To the peer's end of sending; none: too long, or not in time.
std::optional<std::string> receive_all(const Descriptor& socket, std::size_t most) {
  std::string text;
  std::array<char, 4096> block{};
  for (;;) {
    const ssize_t got = ::recv(socket.get(), block.data(), block.size(), 0);
    if (got < 0) return std::nullopt;
    if (got == 0) return text;
    text.append(block.data(), static_cast<std::size_t>(got));
    if (text.size() > most) return std::nullopt;
  }
}

/// None: nobody who may ask.
std::optional<uid_t> user_of(const Descriptor& peer) {
  ucred who{};
  socklen_t size = sizeof who;
  if (::getsockopt(peer.get(), SOL_SOCKET, SO_PEERCRED, &who, &size) != 0) return std::nullopt;
  if (who.uid != 0 && who.uid != ::geteuid()) return std::nullopt;
  return who.uid;
}

}  // namespace

ControlSocket::ControlSocket(const std::filesystem::path& data_dir, Answer answer)
    : folder_(open_folder(data_dir)), answer_(std::move(answer)), socket_(new_socket()) {
  // Whoever left one there is gone: the data directory is ours.
  ::unlinkat(folder_.get(), kName, 0);
  const sockaddr_un address = address_in(folder_);
  if (::bind(socket_.get(), as_sockaddr(address), sizeof address) != 0) fail("bind");
  if (::fchmodat(folder_.get(), kName, 0600, 0) != 0 || ::listen(socket_.get(), kWaiting) != 0)
    fail("listen");
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

ControlSocket::~ControlSocket() {
  thread_.request_stop();
  thread_.join();
  ::unlinkat(folder_.get(), kName, 0);
}

void ControlSocket::serve(const std::stop_token& stop) const {
  while (!stop.stop_requested()) {
    pollfd waiting{socket_.get(), POLLIN, 0};
    if (::poll(&waiting, 1, kLookMilliseconds) <= 0) continue;
    const Descriptor peer(::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!peer) {  // there is no descriptor left; who waits goes on waiting
      std::this_thread::sleep_for(std::chrono::milliseconds(kLookMilliseconds));
    } else if (const auto user = user_of(peer)) {
      serve_one(peer, *user);
    }
  }
}

void ControlSocket::serve_one(const Descriptor& peer, uid_t user) const {
  set_patience(peer);
  if (const auto request = receive_all(peer, kMaxRequestBytes)) send_all(peer, answer_(*request, user));
}

std::optional<std::string> ask_daemon(const std::filesystem::path& data_dir, const std::string& request) {
  const Descriptor folder = open_folder(data_dir);
  if (!folder) return std::nullopt;
  const Descriptor socket = new_socket();
  const sockaddr_un address = address_in(folder);
  if (::connect(socket.get(), as_sockaddr(address), sizeof address) != 0) return std::nullopt;
  set_patience(socket);
  constexpr std::size_t kAnyLength = std::size_t{1} << 30;
  std::optional<std::string> answer;
  if (send_all(socket, request) && ::shutdown(socket.get(), SHUT_WR) == 0)
    answer = receive_all(socket, kAnyLength);
  if (!answer || answer->empty()) throw std::runtime_error("the daemon gave no answer; see its log");
  return answer;
}

}  // namespace volsmooth
