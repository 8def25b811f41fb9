#include "service/pacs/callers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace volsmooth {
namespace {

using boost::asio::ip::make_address_v4;

Callers callers_from(const std::vector<std::string>& networks) {
  return Callers(Preset{.name = "head", .order = {}, .from = networks});
}

Callers callers_of(const std::vector<std::string>& titles) {
  return Callers(Preset{.name = "head", .order = {}, .callers = titles});
}

TEST(Callers, AreEverybodyFromAnywhereUnlessItIsSaid) {
  EXPECT_TRUE(Callers(Preset{.name = "head", .order = {}}).may_be("ANY"));
  EXPECT_TRUE(callers_of({"CT1"}).may_come_from(make_address_v4("8.8.8.8")));
  EXPECT_TRUE(callers_from({"10.0.0.1"}).may_be("ANY"));
}

/// As they are written, since titles differ by case.
TEST(Callers, HaveOneOfTheTitles) {
  const Callers callers = callers_of({"CT1", "CT 2"});
  for (const char* title : {"CT1", "CT 2"}) EXPECT_TRUE(callers.may_be(title)) << title;
  for (const char* title : {"ct1", "CT11", "CT", "", "?", "CT2"})
    EXPECT_FALSE(callers.may_be(title)) << title;
}

/// A network of n bits holds its address with any last 32 - n bits, and nothing else.
TEST(Callers, ComeFromOneOfTheNetworks) {
  const unsigned address = make_address_v4("170.85.204.51").to_uint();
  for (unsigned short length = 0; length <= 32; ++length) {
    const unsigned free_bits = length == 0 ? ~0U : ~(~0U << (32 - length));
    const boost::asio::ip::address_v4 network(address & ~free_bits);
    const Callers callers = callers_from({network.to_string() + "/" + std::to_string(length)});
    for (unsigned bit = 0; bit < 32; ++bit) {
      const bool is_free = ((free_bits >> bit) & 1U) != 0;
      EXPECT_EQ(callers.may_come_from(boost::asio::ip::address_v4(network.to_uint() ^ (1U << bit))), is_free)
          << length << " " << bit;
    }
    EXPECT_TRUE(callers.may_come_from(boost::asio::ip::address_v4(network.to_uint() | free_bits)));
  }
  const Callers two = callers_from({"10.1.0.0/16", "192.0.2.7"});
  for (const char* inside : {"10.1.255.255", "192.0.2.7"})
    EXPECT_TRUE(two.may_come_from(make_address_v4(inside))) << inside;
  for (const char* outside : {"10.2.0.0", "192.0.2.6"})
    EXPECT_FALSE(two.may_come_from(make_address_v4(outside))) << outside;
}

TEST(Callers, WhatIsNoNetworkIsRefused) {
  const std::string neither = "'from' must be a list of IPv4 addresses and networks";
  for (const auto& [text, expected] :
       std::vector<std::pair<std::string, std::string>>{{"", neither},
                                                        {"pacs", neither},
                                                        {"10.1", neither},
                                                        {"10.1.0.0/", neither},
                                                        {"10.1.0.0/33", neither},
                                                        {"10.1.0.0/-1", neither},
                                                        {"10.1.0.0/255.255.0.0", neither},
                                                        {"256.1.0.0/16", neither},
                                                        {"::1", neither},
                                                        {"fe80::/10", neither},
                                                        {"10.1.0.1 ", neither},
                                                        {"10.1.2.3/16", "did you mean '10.1.0.0/16'?"},
                                                        {"10.1.0.0/016", "did you mean '10.1.0.0/16'?"}}) {
    try {
      callers_from({"10.0.0.1", text});
      ADD_FAILURE() << text << " was taken";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::StartsWith("configuration, preset 'head': "),
                                               testing::HasSubstr(expected)))
          << text;
    }
  }
}

}  // namespace
}  // namespace volsmooth
