#include "service/pacs/nodes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using nlohmann::json;

class Nodes : public testing::Test {
 protected:
  std::string file_with(const std::string& text, mode_t mode = 0600) {
    const auto path = scratch_.path() / "credentials";
    std::ofstream(path) << text;
    ::chmod(path.c_str(), mode);
    return path;
  }
  /// A good peer but for these members.
  static json peer(const json& but) {
    json members = {{"host", "pacs"}, {"port", 104}, {"aet", "PACS"}};
    members.update(but);
    return {{"dimse", members}};
  }
  ScratchFolder scratch_;
};

TEST_F(Nodes, AreReadByName) {
  const auto nodes = nodes_from(json{{"pacs", {{"dicomweb", "https://pacs.example/dicom-web/"}}}});
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(nodes[0].name, "pacs");
  EXPECT_EQ(nodes[0].url, "https://pacs.example/dicom-web");
  EXPECT_EQ(nodes[0].login + nodes[0].token, "");
}

TEST_F(Nodes, CredentialsAreALoginOrAToken) {
  const json login = {{"p", {{"dicomweb", "http://p"}, {"credentials_file", file_with("me:secret:x\n")}}}};
  EXPECT_EQ(nodes_from(login)[0].login, "me:secret:x");
  const json token = {{"p", {{"dicomweb", "http://p"}, {"credentials_file", file_with("abc.def\n")}}}};
  EXPECT_EQ(nodes_from(token)[0].token, "abc.def");
}

TEST_F(Nodes, APeerIsAHostAPortAndAnAeTitle) {
  const auto nodes =
      nodes_from(json{{"p", {{"dimse", {{"host", "pacs-1.example"}, {"port", 104}, {"aet", "PACS"}}}}}});
  ASSERT_EQ(nodes.size(), 1U);
  ASSERT_TRUE(nodes[0].dimse);
  EXPECT_EQ(nodes[0].dimse->host, "pacs-1.example");
  EXPECT_EQ(nodes[0].dimse->port, 104);
  EXPECT_EQ(nodes[0].dimse->called, "PACS");
  EXPECT_EQ(nodes[0].dimse->calling, "VOLSMOOTH");
  const json ours = {{"p", peer({{"calling_aet", "SMOOTHER"}})}};
  EXPECT_EQ(nodes_from(ours)[0].dimse->calling, "SMOOTHER");
}

TEST_F(Nodes, APeerByTlsHasToProveItsName) {
  const auto tls_of = [](const json& tls) {
    return document_of(*nodes_from(json{{"p", peer({{"tls", tls}})}})[0].dimse->tls);
  };
  EXPECT_EQ(tls_of({{"ca_file", "a"}}), json({{"ca_file", "a"}, {"name", "pacs"}}));
  const json all{{"ca_file", "a"}, {"cert_file", "b"}, {"key_file", "c"}};
  json expected = all;
  expected["name"] = "pacs.example";
  json configured = all;
  configured["server_name"] = "pacs.example";
  EXPECT_EQ(tls_of(configured), expected);
}

TEST_F(Nodes, AreEverybodysOrOfTenants) {
  const json two = {"ward-a", "ward-b"};
  const auto nodes = nodes_from(json{{"a", {{"dicomweb", "http://p"}}},
                                     {"b", {{"dicomweb", "http://p"}, {"tenants", two}}},
                                     {"c", {{"dimse", peer(json::object()).at("dimse")}, {"tenants", two}}}});
  EXPECT_TRUE(nodes[0].tenants.empty());
  for (const Node& node : {nodes[1], nodes[2]})
    EXPECT_THAT(node.tenants, testing::ElementsAre("ward-a", "ward-b"));
  EXPECT_TRUE(nodes[2].dimse);
}

/// DCMTK would connect to what is left of a longer one.
TEST_F(Nodes, APeerHasAnAddressOf63CharactersAtMost) {
  const auto with = [](std::size_t host_length, int port) {
    return nodes_from(json{{"p", peer({{"host", std::string(host_length, 'h')}, {"port", port}})}});
  };
  EXPECT_EQ(with(59, 104)[0].dimse->host.size(), 59U);
  EXPECT_EQ(with(57, 11112)[0].dimse->host.size(), 57U);
  for (const auto& [host_length, port] : {std::pair{60, 104}, {58, 11112}, {253, 4}}) {
    try {
      with(static_cast<std::size_t>(host_length), port);
      ADD_FAILURE() << host_length << " was taken";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("node 'p': 'host', a colon and 'port' must be 63"));
    }
  }
}

TEST_F(Nodes, WhatIsWrongIsRefusedWithItsPlace) {
  const std::vector<std::pair<json, std::string>> table = {
      {json::array(), "'nodes' must be an object"},
      {{{"a b", {{"dicomweb", "http://p"}}}}, "a name has"},
      {{{"p", "http://p"}}, "must be an object with 'dicomweb'"},
      {{{"p", json::object()}}, "'dicomweb' must be an http"},
      {{{"p", {{"dicomweb", 5}}}}, "'dicomweb' must be text"},
      {{{"p", {{"dicomweb", "file:///etc"}}}}, "'dicomweb' must be an http"},
      {{{"p", {{"dicomweb", "http://p?x=1"}}}}, "without a query"},
      {{{"p", {{"dicomweb", "http://me:secret@p/x"}}}}, "without a login"},
      {{{"p", {{"dicomweb", "http://p"}, {"tls", true}}}}, "'tls' is not known"},
      {{{"p", {{"dicomweb", "http://p"}, {"tenant", {"a"}}}}}, "did you mean 'tenants'?"},
      {{{"p", {{"dicomweb", "http://p"}, {"tenants", "a"}}}}, "'tenants' must be a list of one or more"},
      {{{"p", {{"dicomweb", "http://p"}, {"tenants", json::array()}}}}, "'tenants' must be a list of one"},
      {{{"p", {{"dicomweb", "http://p"}, {"tenants", {"a", 5}}}}}, "'tenants' must be a list of one or"},
      {{{"p", {{"dicomweb", "http://p"}, {"tenants", {"a", "b c"}}}}}, "'tenants' must be a list of one or"},
      {{{"p", {{"dimse", json::object()}, {"tenants", nullptr}}}}, "'tenants' must be a list of one or"},
      {{{"p", {{"dicomweb", "http://p"}, {"credentials_file", "/nowhere"}}}}, "cannot be read"},
      {{{"p", {{"dicomweb", "http://p"}, {"credentials_file", file_with("t", 0640)}}}}, "owner's alone"},
      {{{"p", {{"dicomweb", "http://p"}, {"dimse", json::object()}}}}, "has no other member"},
      {{{"p", {{"dimse", "pacs:104"}}}}, "'dimse' must be an object with"},
      {{{"p", peer({{"ae", "X"}})}}, "'ae' is not known"},
      {{{"p", peer({{"tls", true}})}}, "'tls' must be an object with 'ca_file'"},
      {{{"p", peer({{"tls", json::object()}})}}, "'tls' needs 'ca_file'"},
      {{{"p", peer({{"tls", {{"ca_file", 5}}}})}}, "'ca_file' must be text"},
      {{{"p", peer({{"tls", {{"ca_file", "a"}, {"cert_file", "b"}}}})}}, "both 'cert_file' and 'key_file'"},
      {{{"p", peer({{"tls", {{"ca_file", "a"}, {"key_file", "b"}}}})}}, "both 'cert_file' and 'key_file'"},
      {{{"p", peer({{"tls", {{"ca_file", "a"}, {"verify", false}}}})}}, "'verify' is not known"},
      {{{"p", peer({{"host", ""}})}}, "'host' must be a name"},
      {{{"p", peer({{"host", "::1"}})}}, "'host' must be a name or an IPv4"},
      {{{"p", peer({{"host", "pacs/x"}})}}, "'host' must be a name"},
      {{{"p", peer({{"port", 0}})}}, "'port' must be a number from 1"},
      {{{"p", peer({{"port", 65536}})}}, "'port' must be a number from 1"},
      {{{"p", peer({{"port", "104"}})}}, "'port' must be a number from 1"},
      {{{"p", peer({{"aet", "SEVENTEEN_LETTERS"}})}}, "'aet' must be an AE title"},
      {{{"p", peer({{"aet", nullptr}})}}, "'aet' must be text"},
      {{{"p", peer({{"calling_aet", ""}})}}, "'calling_aet' must be an AE title"},
  };
  for (const auto& [configured, expected] : table) {
    try {
      nodes_from(configured);
      ADD_FAILURE() << configured << " was taken";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(expected)) << configured;
    }
  }
}

TEST_F(Nodes, SecretsAreNotEchoed) {
  const json bad = {{"p", {{"dicomweb", "http://p"}, {"credentials_file", file_with("to\x01ken\n")}}}};
  try {
    nodes_from(bad);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("ken")));
  }
}

}  // namespace
}  // namespace volsmooth
