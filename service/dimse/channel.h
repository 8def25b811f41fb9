#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace volsmooth {

// What volsmoothd and volsmooth-dimse say to each other, over a stream socket that is the child's standard
// input. Instances are Part 10 files (DICOM PS3.10): their bytes, in pieces, then a document that ends them.
//
// send: the daemon asks for an association, {"host", "port", "called", "calling", "sop_classes": [UID]}, by
// TLS with "tls", and gets {} or a failure. Then, for each instance, it sends its bytes, {"sop_class",
// "sop_instance"}, and gets {"status": of the C-STORE response}, {"failure": "not-accepted" | "unreadable"},
// or a failure that ends it all. It closes its side when it has no more. A failure is {"failure":
// "unreachable" | "lost" | "tls" (not agreed on, or no trust) | "tls-files" (cannot be used)}, or {"failure":
// "rejected", "result", "source", "reason"} with the numbers of PS3.8, 9.3.4.
//
// receive: the daemon says {}, or {"tls"}. The child, whose descriptor 3 is an accepted connection, says
// {"called", "calling"}, or {"failure": "tls" | "tls-files"} when it comes to no association, and gets
// {"reject": 0 or source << 8 | reason}. Then, for each instance that came whole, the daemon gets its bytes
// and {"sop_class", "sop_instance"}, and answers {"status": for the C-STORE response}. {"alive": true} wants
// no answer: the peer asked for an echo. {"released": true} is the good end; without it the peer broke off.
//
// check-tls: the daemon says {"tls"}, and gets {} or {"member": which file, "why": it cannot be used}.
//
// "tls" is {"ca_file", "cert_file", "key_file", "name"}: paths of PEM files, the second and third both or
// neither, and the name or address that the peer's certificate has to have, if any.
//
// All: {"failure": "internal"} is the last word of a child that cannot do its work, for no fault of the
// peer's.

constexpr int kChannelDescriptor = 0, kConnectionDescriptor = 3;
/// "host:port" of a peer: DCMTK has no room for more, and would cut it off.
constexpr std::size_t kLongestAddress = 63;

/// The other side is gone, silent, or says what it must not.
class ChannelError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One end of the stream, whose descriptor stays its owner's. Used by one thread at a time.
class Channel {
 public:
  explicit Channel(int descriptor) : descriptor_(descriptor) {}

  struct Message {
    bool is_document = false;
    std::string content;
  };
  static constexpr std::size_t kLongestMessage = std::size_t{1} << 20;

  // All of these throw ChannelError. `send` waits for the other side for kStalled at most.

  void send(const nlohmann::json& document);
  void send_bytes(std::span<const std::byte> bytes);
  /// None: the other side has closed it.
  std::optional<Message> receive(std::chrono::milliseconds patience);
  /// A document, when nothing else may come.
  nlohmann::json receive_document(std::chrono::milliseconds patience);

  static constexpr std::chrono::seconds kStalled{120};

 private:
  void send(char kind, std::string_view content);
  bool read_exactly(std::span<char> into, std::chrono::milliseconds patience);

  const int descriptor_;
};

/// The document that a message is; throws ChannelError.
nlohmann::json document_of(const Channel::Message& message);

}  // namespace volsmooth
