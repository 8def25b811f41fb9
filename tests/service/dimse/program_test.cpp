// volsmooth-dimse itself, between a daemon and a peer that say what the tests like.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <seccomp.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include "service/dimse/part10.h"
#include "service/pacs/dimse_child.h"
#include "tests/support/loopback.h"
#include "tests/support/raw_association.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/test_certificate.h"

namespace volsmooth {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;
using namespace volsmooth::test;

constexpr auto kPatience = 30s;
const char* const kCtImages = "1.2.840.10008.5.1.4.1.1.2";

/// Where a peer listens.
class Place {
 public:
  int port() const { return port_of(socket_.get()); }
  FileDescriptor accepted() const { return FileDescriptor(::accept(socket_.get(), nullptr, nullptr)); }
  FileDescriptor connected() const { return FileDescriptor(connect_to_loopback(port())); }

 private:
  FileDescriptor socket_{listen_on_loopback()};
};

void say(const FileDescriptor& socket, const std::string& bytes) {
  EXPECT_EQ(::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL), std::ssize(bytes));
}

/// The type of the next PDU, which is read whole.
int next_pdu(const FileDescriptor& socket) {
  unsigned char head[6] = {};
  if (::recv(socket.get(), head, sizeof head, MSG_WAITALL) != sizeof head) return -1;
  std::string rest((head[2] << 24 | head[3] << 16 | head[4] << 8 | head[5]), '\0');
  return ::recv(socket.get(), rest.data(), rest.size(), MSG_WAITALL) == std::ssize(rest) ? head[0] : -1;
}

json association_with(const std::string& host, int port) {
  return {
      {"host", host}, {"port", port}, {"called", "HEAD"}, {"calling", "RAW"}, {"sop_classes", {kCtImages}}};
}

TEST(DimseProgram, AnEchoIsASignOfLife) {
  const Place place;
  const FileDescriptor peer = place.connected();
  const DimseChild child("receive", place.accepted().get());
  Channel channel = child.channel();
  channel.send(json::object());
  say(peer, association_request());
  EXPECT_EQ(channel.receive_document(kPatience), json({{"called", "HEAD"}, {"calling", "RAW"}}));
  channel.send({{"reject", 0}});
  EXPECT_EQ(next_pdu(peer), 2);  // A-ASSOCIATE-AC
  for (int i = 0; i < 2; ++i) {
    say(peer, echo_request());
    EXPECT_EQ(channel.receive_document(kPatience), json({{"alive", true}}));
    EXPECT_EQ(next_pdu(peer), 4);  // P-DATA-TF
  }
  say(peer, release_request());
  EXPECT_EQ(channel.receive_document(kPatience), json({{"released", true}}));
  EXPECT_EQ(next_pdu(peer), 6);  // A-RELEASE-RP
}

/// The fault is not the peer's, and the next instance may be better.
TEST(DimseProgram, AnInstanceThatCannotBeReadIsToldAndTheAssociationGoesOn) {
  const Place place;
  const DimseChild child("send");
  Channel channel = child.channel();
  channel.send(association_with("127.0.0.1", place.port()));
  const FileDescriptor peer = place.accepted();
  EXPECT_EQ(next_pdu(peer), 1);  // A-ASSOCIATE-RQ
  say(peer, association_acceptance());
  EXPECT_EQ(channel.receive_document(kPatience), json::object());
  const std::string cut_off = part10_head(kCtImages, "1.2", "1.2.840.10008.1.2") +
                              std::string("\x10\0\x10\0\xff\0\0\0Doe", 11);  // a name of 255 letters
  for (int i = 0; i < 2; ++i) {
    channel.send_bytes(std::as_bytes(std::span(cut_off)));
    channel.send({{"sop_class", kCtImages}, {"sop_instance", "1.2"}});
    EXPECT_EQ(channel.receive_document(kPatience), json({{"failure", "unreadable"}}));
  }
}

TEST(DimseProgram, AnAddressThatWouldBeCutOffIsNotConnectedTo) {
  const DimseChild child("send");
  Channel channel = child.channel();
  channel.send(association_with(std::string(60, 'h'), 11112));
  EXPECT_EQ(channel.receive_document(kPatience), json({{"failure", "internal"}}));
}

TEST(DimseProgram, SaysWhichFileOfTlsCannotBeUsed) {
  const ScratchFolder scratch;
  const auto ours = TestCertificate::make(scratch.path(), "ours"),
             other = TestCertificate::make(scratch.path(), "other"),
             locked = TestCertificate::make(scratch.path(), "locked", "secret");
  const json good{{"ca_file", other.certificate}, {"cert_file", ours.certificate}, {"key_file", ours.key}};
  const auto but = [&](const json& changed) {
    json tls = good;
    tls.update(changed);
    return tls;
  };
  const std::vector<std::pair<json, std::string>> table = {
      {good, ""},
      {{{"ca_file", other.certificate}}, ""},
      {but({{"ca_file", scratch / "nowhere"}}), "ca_file"},
      {but({{"ca_file", other.key}}), "ca_file"},
      {but({{"cert_file", scratch / "nowhere"}}), "cert_file"},
      {but({{"cert_file", ours.key}}), "cert_file"},
      {but({{"key_file", scratch / "nowhere"}}), "key_file"},
      {but({{"key_file", other.key}}), "key_file"},
      {but({{"cert_file", locked.certificate}, {"key_file", locked.key}}), "key_file"}};
  for (const auto& [tls, expected] : table) {
    const DimseChild child("check-tls");
    Channel channel = child.channel();
    channel.send({{"tls", tls}});
    EXPECT_EQ(channel.receive_document(kPatience).value("member", ""), expected) << tls;
  }
}

/// They were good when the daemon started.
TEST(DimseProgram, FilesOfTlsThatAreGoneAreTold) {
  const Place place;
  const FileDescriptor peer = place.connected();
  const DimseChild receiving("receive", place.accepted().get()), sending("send");
  json association = association_with("127.0.0.1", place.port());
  association["tls"] = {{"ca_file", "/nowhere"}};
  receiving.channel().send(association);
  sending.channel().send(association);
  for (const DimseChild* child : {&receiving, &sending})
    EXPECT_EQ(child->channel().receive_document(kPatience), json({{"failure", "tls-files"}}));
}

/// In a process that may set no limits, so that the sandbox cannot be entered.
json told_without_sandbox(const std::function<json()>& told) {
  int ends[2];
  EXPECT_EQ(::pipe(ends), 0);
  if (const pid_t process = ::fork(); process == 0) {
    const scmp_filter_ctx filter = ::seccomp_init(SCMP_ACT_ALLOW);
    ::seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(prlimit64), 0);
    ::seccomp_load(filter);
    std::string text;
    try {
      text = told().dump();
    } catch (const std::exception& error) {
      text = json(error.what()).dump();
    }
    (void)!::write(ends[1], text.data(), text.size());
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string text(1000, '\0');
  const ssize_t got = ::read(ends[0], text.data(), text.size());
  ::close(ends[0]);
  ::wait(nullptr);
  return json::parse(text.substr(0, static_cast<std::size_t>(got)));
}

TEST(DimseProgram, AMissingSandboxIsToldAsAFaultOfOurs) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the address sanitizer sets limits itself";
#endif
  const Place place;
  const FileDescriptor peer = place.connected();
  EXPECT_EQ(told_without_sandbox([&] {
              const DimseChild child("receive", place.accepted().get());
              Channel channel = child.channel();
              channel.send(json::object());
              return channel.receive_document(kPatience);
            }),
            json({{"failure", "internal"}}));
  const Place other;
  EXPECT_EQ(told_without_sandbox([&] {
              const DimseChild child("send");
              Channel channel = child.channel();
              channel.send(association_with("127.0.0.1", other.port()));
              return channel.receive_document(kPatience);
            }),
            json({{"failure", "internal"}}));
}

}  // namespace
}  // namespace volsmooth
