#include "service/pacs/listening_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace volsmooth {
namespace {

std::string refusal_of(const std::string& listen, bool allow_open_network = false) {
  try {
    listen_for_dimse(listen, allow_open_network);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(ListeningSocket, SaysItsPort) {
  const ListeningSocket socket = listen_for_dimse("localhost:0", false);
  EXPECT_THAT(socket.address, testing::MatchesRegex("127\\.0\\.0\\.1:[0-9]+"));
  EXPECT_FALSE(socket.address.ends_with(":0"));
}

TEST(ListeningSocket, ATakenPortIsSaid) {
  const ListeningSocket socket = listen_for_dimse("127.0.0.1:0", false);
  EXPECT_THAT(refusal_of(socket.address), testing::HasSubstr("cannot listen for DIMSE on " + socket.address +
                                                             ": Address already in use"));
}

TEST(ListeningSocket, OthersReachItOnlyWhenThatIsAllowed) {
  EXPECT_THAT(refusal_of("0.0.0.0:0"), testing::HasSubstr("--allow-open-dimse"));
  EXPECT_EQ(refusal_of("0.0.0.0:0", true), "");
  EXPECT_EQ(refusal_of("127.1.2.3:0"), "");
}

TEST(ListeningSocket, WhatIsNoAddressIsRefused) {
  for (const char* listen : {"", "11112", "pacs:11112", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536",
                             "127.0.0.1:1x", "[::1]:11112", "127.0.0.1:-1"})
    EXPECT_THAT(refusal_of(listen), testing::HasSubstr("takes an IPv4 address and a port")) << listen;
}

}  // namespace
}  // namespace volsmooth
