#include "service/dimse/channel.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace volsmooth {
namespace {

constexpr char kDocument = 'd', kBytes = 'b';
constexpr std::size_t kPiece = std::size_t{256} << 10;

/// A kind and a length of 32 bits, the lowest first.
using Head = std::array<char, 5>;

Head head_of(char kind, std::size_t length) {
  Head head{kind};
  for (std::size_t i = 1; i < head.size(); ++i) head[i] = static_cast<char>(length >> (8 * (i - 1)) & 0xFF);
  return head;
}

std::size_t length_in(const Head& head) {
  std::size_t length = 0;
  for (std::size_t i = head.size(); i-- > 1;) length = length << 8 | static_cast<unsigned char>(head[i]);
  return length;
}

void wait_for(int descriptor, short event, std::chrono::milliseconds patience) {
  pollfd polled{descriptor, event, 0};
  const int ready = ::poll(&polled, 1, static_cast<int>(patience.count()));
  if (ready == 0) throw ChannelError("the other side is silent");
  if (ready < 0 && errno != EINTR) throw ChannelError("the other side cannot be waited for");
}

bool is_worth_waiting(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

void write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t put = ::send(descriptor, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (put >= 0) {
      text.remove_prefix(static_cast<std::size_t>(put));
    } else if (is_worth_waiting(errno)) {
      wait_for(descriptor, POLLOUT, Channel::kStalled);
    } else {
      throw ChannelError("the other side is gone");
    }
  }
}

}  // namespace

void Channel::send(char kind, std::string_view content) {
  const Head head = head_of(kind, content.size());
  write_all(descriptor_, {head.data(), head.size()});
  write_all(descriptor_, content);
}

void Channel::send(const nlohmann::json& document) {
  send(kDocument, document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

void Channel::send_bytes(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const auto piece = bytes.first(std::min(bytes.size(), kPiece));
    send(kBytes, {reinterpret_cast<const char*>(piece.data()), piece.size()});
    bytes = bytes.subspan(piece.size());
  }
}

/// False: it was closed before the first byte.
bool Channel::read_exactly(std::span<char> into, std::chrono::milliseconds patience) {
  const std::size_t wanted = into.size();
  while (!into.empty()) {
    const ssize_t got = ::recv(descriptor_, into.data(), into.size(), MSG_DONTWAIT);
    if (got > 0) {
      into = into.subspan(static_cast<std::size_t>(got));
    } else if (got < 0 && is_worth_waiting(errno)) {
      wait_for(descriptor_, POLLIN, patience);
    } else if (into.size() == wanted) {
      return false;  // a side that was killed with words of ours unread resets it: closed as well
    } else {
      throw ChannelError("the other side broke off");
    }
  }
  return true;
}

std::optional<Channel::Message> Channel::receive(std::chrono::milliseconds patience) {
  Head head;
  if (!read_exactly(head, patience)) return std::nullopt;
  const std::size_t length = length_in(head);
  if (length > kLongestMessage || (head[0] != kDocument && head[0] != kBytes))
    throw ChannelError("the other side says what it must not");
  Message message{head[0] == kDocument, std::string(length, '\0')};
  if (length > 0 && !read_exactly(message.content, patience)) throw ChannelError("the other side broke off");
  return message;
}

nlohmann::json Channel::receive_document(std::chrono::milliseconds patience) {
  const auto message = receive(patience);
  if (!message) throw ChannelError("the other side is gone");
  return document_of(*message);
}

nlohmann::json document_of(const Channel::Message& message) {
  auto document = message.is_document ? nlohmann::json::parse(message.content, nullptr, false) : nullptr;
  if (!document.is_object()) throw ChannelError("the other side says what it must not");
  return document;
}

}  // namespace volsmooth
