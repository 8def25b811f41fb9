#include "client/server_address.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

struct AddressCase {
  const char *text, *url, *socket;
  bool is_local;
};

class Server : public testing::TestWithParam<AddressCase> {};

TEST_P(Server, IsRead) {
  const auto server = parse_server(GetParam().text);
  ASSERT_TRUE(server) << server.error().sentence;
  EXPECT_EQ(server->url, GetParam().url);
  EXPECT_EQ(server->socket_path, GetParam().socket);
  EXPECT_EQ(server->is_local(), GetParam().is_local);
}

INSTANTIATE_TEST_SUITE_P(
    Texts, Server,
    testing::Values(AddressCase{"http://127.0.0.1:8742", "http://127.0.0.1:8742", "", true},
                    AddressCase{"http://localhost:1/", "http://localhost:1", "", true},
                    AddressCase{"http://[::1]:8742", "http://[::1]:8742", "", true},
                    AddressCase{"http://127.evil.example", "http://127.evil.example", "", false},
                    AddressCase{"https://smooth.example/base/", "https://smooth.example/base", "", false},
                    AddressCase{"unix:/run/v/socket", "http://localhost", "/run/v/socket", true},
                    AddressCase{"unix:///run/v/socket", "http://localhost", "/run/v/socket", true},
                    AddressCase{"http+unix:///run/v", "http://localhost", "/run/v", true},
                    AddressCase{"http+unix://%2Frun%2Fv", "http://localhost", "/run/v", true}));

TEST(Server, IsConfidentialByTlsOrOnThisMachine) {
  for (const char* text : {"https://smooth.example", "http://127.0.0.1:8742", "unix:/run/v"})
    EXPECT_TRUE(parse_server(text)->is_confidential()) << text;
  for (const char* text : {"http://smooth.example", "http://10.0.0.1:8742", "http://127.0.0.1.example"})
    EXPECT_FALSE(parse_server(text)->is_confidential()) << text;
}

class NoServer : public testing::TestWithParam<std::string> {};

TEST_P(NoServer, IsAUsageError) {
  const auto server = parse_server(GetParam());
  ASSERT_FALSE(server);
  EXPECT_EQ(server.error().code, ExitCode::kUsage);
}

INSTANTIATE_TEST_SUITE_P(Texts, NoServer,
                         testing::Values("", "localhost:8742", "ftp://host", "http://",
                                         "http://user:secret@host", "http://host:port", "http://host/?a=b",
                                         "unix:relative", "unix:", "unix:/" + std::string(200, 'a'),
                                         "file:///etc/passwd"));

}  // namespace
}  // namespace volsmooth
