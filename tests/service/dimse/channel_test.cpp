#include "service/dimse/channel.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <thread>
#include <vector>

namespace volsmooth {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

class ChannelOf : public testing::Test {
 protected:
  ~ChannelOf() override {
    close_other();
    ::close(ends_[0]);
  }
  void close_other() {
    if (ends_[1] >= 0) ::close(std::exchange(ends_[1], -1));
  }
  void say(const std::string& raw) const {
    ASSERT_EQ(::write(ends_[1], raw.data(), raw.size()), std::ssize(raw));
  }

  static std::array<int, 2> socket_pair() {
    std::array<int, 2> ends{-1, -1};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
    return ends;
  }

  std::array<int, 2> ends_ = socket_pair();
  Channel channel_{ends_[0]};
};

TEST_F(ChannelOf, WhatIsSaidIsHeard) {
  Channel other(ends_[1]);
  other.send({{"status", 7}});
  EXPECT_EQ(channel_.receive_document(1s), json({{"status", 7}}));
  other.send_bytes({});
  other.send(json::object());
  EXPECT_EQ(channel_.receive_document(1s), json::object());
}

TEST_F(ChannelOf, BytesComeInPiecesAndInOrder) {
  std::vector<std::byte> bytes(3'000'001);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i % 251);
  std::jthread saying([&] {
    Channel other(ends_[1]);
    other.send_bytes(bytes);
    other.send({{"end", true}});
  });
  std::string heard;
  while (true) {
    const auto message = channel_.receive(10s);
    ASSERT_TRUE(message);
    if (message->is_document) break;
    EXPECT_LE(message->content.size(), Channel::kLongestMessage);
    heard += message->content;
  }
  ASSERT_EQ(heard.size(), bytes.size());
  EXPECT_EQ(std::memcmp(heard.data(), bytes.data(), bytes.size()), 0);
}

TEST_F(ChannelOf, AnEndBetweenMessagesIsNoError) {
  close_other();
  EXPECT_FALSE(channel_.receive(1s));
  EXPECT_THROW(channel_.receive_document(1s), ChannelError);
  EXPECT_THROW(channel_.send(json::object()), ChannelError);
}

std::string error_of(const auto& call) {
  try {
    call();
  } catch (const ChannelError& error) {
    return error.what();
  }
  return "";
}

TEST_F(ChannelOf, WhatMustNotBeSaidIsAnError) {
  const std::string refused = "the other side says what it must not";
  for (const std::string raw : {"[]", "{", "5", ""}) {
    say(std::string("d") + static_cast<char>(raw.size()) + std::string(3, '\0') + raw);
    EXPECT_EQ(error_of([&] { channel_.receive_document(1s); }), refused) << raw;
  }
  say(std::string("b\2\0\0\0{}", 7));  // bytes where a document is expected
  EXPECT_EQ(error_of([&] { channel_.receive_document(1s); }), refused);
}

TEST_F(ChannelOf, WhatIsNoMessageIsAnErrorAtOnce) {
  const std::string heads[] = {std::string("x\0\0\0\0", 5),          // of no kind
                               std::string("d\xff\xff\xff\xff", 5),  // of 4 GB
                               std::string("d\1\0\x10\0", 5)};       // a byte too long
  for (const std::string& head : heads) {
    say(head);
    EXPECT_EQ(error_of([&] { channel_.receive(1s); }), "the other side says what it must not") << head;
  }
}

TEST_F(ChannelOf, ABrokenMessageIsAnError) {
  say(std::string("d\5\0\0\0{", 6));
  close_other();
  EXPECT_THROW(channel_.receive(1s), ChannelError);
}

TEST_F(ChannelOf, SilenceIsAnError) {
  EXPECT_THROW(channel_.receive(10ms), ChannelError);
  say("d");
  EXPECT_THROW(channel_.receive(10ms), ChannelError);
}

}  // namespace
}  // namespace volsmooth
