#include "service/pacs/dimse_child.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>

namespace volsmooth {
namespace {

/// The only child of this thread.
pid_t only_child() {
  pid_t child = 0;
  std::ifstream("/proc/thread-self/children") >> child;
  return child;
}

/// Ctrl-C and a stop by systemd go to the children as well, whose work the daemon still needs to end in
/// order.
TEST(DimseChild, WhatEndsTheDaemonDoesNotEndIt) {
  const DimseChild child("send");
  ASSERT_GT(only_child(), 0);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ASSERT_EQ(::kill(only_child(), signal), 0);
  Channel channel = child.channel();
  channel.send({{"host", "127.0.0.1"},
                {"port", 1},  // where nobody listens
                {"called", "A"},
                {"calling", "B"},
                {"sop_classes", {"1.2.840.10008.5.1.4.1.1.2"}}});
  EXPECT_EQ(channel.receive_document(std::chrono::seconds(30)).at("failure"), "unreachable");
}

}  // namespace
}  // namespace volsmooth
