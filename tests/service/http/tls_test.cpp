#include <csignal>

#include "service/jobs/tokens.h"
#include "tests/service/http/running_server.h"
#include "tests/support/test_certificate.h"
#include "tests/support/tls_client.h"

namespace volsmooth {
namespace {

using namespace std::chrono_literals;

class Tls : public ServerTest {
 protected:
  Tls() {
    ::signal(SIGPIPE, SIG_IGN);  // a connection that is closed in the handshake
    start(settings());
  }

  ServerSettings settings() const {
    ServerSettings settings{.listen = "127.0.0.1:0"};
    settings.tls_certificate = identity_.certificate;
    settings.tls_key = identity_.key;
    return settings;
  }
  std::string plain_address() const { return "http" + server_->address().substr(5); }

  static std::string get(const std::string& target) { return request("GET " + target); }
  /// The head of an answer that has a length, and its body.
  static std::pair<std::string, std::string> exchange(TlsClient& client, const std::string& bytes) {
    EXPECT_TRUE(client.send(bytes));
    std::string head = client.receive_until("\r\n\r\n");
    const auto length = head.find("Content-Length: ");
    if (length == head.npos) return {head, ""};
    return {head, client.receive(std::stoul(head.substr(length + 16)))};
  }

  ScratchFolder folder_;
  TestCertificate identity_ = TestCertificate::make(folder_.path(), "first");
};

TEST_F(Tls, AnswersAsInTheClear) {
  ASSERT_TRUE(server_->address().starts_with("https://127.0.0.1:"));
  TlsClient client(server_->address());
  ASSERT_TRUE(client.handshake());
  EXPECT_EQ(client.version(), "TLSv1.3");
  const std::string voxels(3'000'000, 'v');
  const auto [head, body] = exchange(client, request("POST /v1/volumes", voxels));
  ASSERT_TRUE(head.starts_with("HTTP/1.1 201 ")) << head;
  EXPECT_NE(head.find("Strict-Transport-Security: max-age=31536000\r\n"), head.npos);
  const std::string id = nlohmann::json::parse(body).at("id");
  EXPECT_EQ(exchange(client, get("/v1/volumes/" + id + "/content")).second, voxels);
  EXPECT_TRUE(exchange(client, request("GET /healthz", "", "Connection: close\r\n"))
                  .first.starts_with("HTTP/1.1 200"));
  EXPECT_TRUE(client.is_closed_cleanly());
}

TEST_F(Tls, IsNewEnoughAndAuthenticated) {
  const auto offers = [](int version, const char* ciphers) {
    return [=](SSL_CTX* context) {
      SSL_CTX_set_min_proto_version(context, version);
      SSL_CTX_set_max_proto_version(context, version);
      if (ciphers) SSL_CTX_set_cipher_list(context, ciphers);
    };
  };
  for (const char* good : {"ECDHE-ECDSA-AES256-GCM-SHA384", "ECDHE-ECDSA-CHACHA20-POLY1305"}) {
    TlsClient client(server_->address(), offers(TLS1_2_VERSION, good));
    EXPECT_TRUE(client.handshake()) << good;
    EXPECT_EQ(client.cipher(), good);
  }
  for (const char* bad : {"ECDHE-ECDSA-AES256-SHA384", "ECDHE-ECDSA-AES128-SHA", "AES256-GCM-SHA384", "NULL"})
    EXPECT_FALSE(TlsClient(server_->address(), offers(TLS1_2_VERSION, bad)).handshake()) << bad;
  for (const int old : {TLS1_VERSION, TLS1_1_VERSION})
    EXPECT_FALSE(TlsClient(server_->address(), offers(old, "ALL:@SECLEVEL=0")).handshake());
}

TEST_F(Tls, SpeaksHttp11Only) {
  const auto offers = [](const std::string& protocols) {
    return [=](SSL_CTX* context) {
      SSL_CTX_set_alpn_protos(context, reinterpret_cast<const unsigned char*>(protocols.data()),
                              static_cast<unsigned int>(protocols.size()));
    };
  };
  TlsClient both(server_->address(), offers("\x02h2\x08http/1.1"));
  ASSERT_TRUE(both.handshake());
  EXPECT_EQ(both.protocol(), "http/1.1");
  EXPECT_FALSE(TlsClient(server_->address(), offers("\x02h2")).handshake());
}

TEST_F(Tls, ANewCertificateIsForNewConnections) {
  TlsClient before(server_->address());
  ASSERT_TRUE(before.handshake());
  const auto second = TestCertificate::make(folder_.path(), "second");
  std::filesystem::rename(second.certificate, identity_.certificate);
  EXPECT_THROW(server_->reload_tls(), std::runtime_error) << "a key that is not the certificate's";
  TlsClient meanwhile(server_->address());
  ASSERT_TRUE(meanwhile.handshake());
  EXPECT_EQ(meanwhile.subject(), "first");
  std::filesystem::rename(second.key, identity_.key);
  server_->reload_tls();
  TlsClient after(server_->address());
  ASSERT_TRUE(after.handshake());
  EXPECT_EQ(after.subject(), "second");
  for (TlsClient* client : {&before, &meanwhile, &after})
    EXPECT_TRUE(exchange(*client, get("/healthz")).first.starts_with("HTTP/1.1 200"));
}

TEST_F(Tls, WhoSpeaksInTheClearIsToldSo) {
  HttpClient client(plain_address());
  const HttpAnswer answer = client.exchange(get("/healthz"));
  EXPECT_EQ(answer.status, 400);
  EXPECT_EQ(slug(answer), "bad-header");
  EXPECT_TRUE(client.is_closed());
}

TEST_F(Tls, AHandshakeThatStallsIsGivenUp) {
  ServerSettings quick = settings();
  quick.handshake_seconds = 0.2;
  start(quick);
  for (const std::string& begun : {std::string(), std::string("\x16\x03\x01\x02", 4)}) {
    HttpClient client(plain_address());
    const auto start = std::chrono::steady_clock::now();
    client.send(begun);
    EXPECT_TRUE(client.is_closed());
    EXPECT_LT(std::chrono::steady_clock::now() - start, 5s);
  }
  HttpClient trickle(plain_address());  // never still, never done
  bool open = true;
  const auto start = std::chrono::steady_clock::now();
  for (const char byte :
       std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03") + std::string(500, 'x')) {
    open = trickle.send({&byte, 1});
    if (!open || std::chrono::steady_clock::now() - start > 5s) break;
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_FALSE(open);
}

TEST_F(Tls, StrangersGetSoManyHandshakesAndWhoHasATokenAnyNumber) {
  Token token;
  token.name = "known";
  token.scopes = {Scope::kRead};
  const auto begun = [&](int tries) {
    int count = 0;
    for (int i = 0; i < tries; ++i) count += TlsClient(server_->address()).handshake() ? 1 : 0;
    return count;
  };
  EXPECT_EQ(begun(60), 60) << "as long as everyone is let in, nobody is a stranger";
  const std::string text = jobs_.tokens().create(token).value();
  TlsClient client(server_->address());
  ASSERT_TRUE(client.handshake());
  const auto start = std::chrono::steady_clock::now();
  const int strangers = begun(100), more = begun(20);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  EXPECT_GE(strangers, 39);
  EXPECT_LE(strangers + more, 40 + 10 * taken.count());
  const std::string authorized = request("GET /v1/jobs", "", "Authorization: Bearer " + text + "\r\n");
  ASSERT_TRUE(exchange(client, authorized).first.starts_with("HTTP/1.1 200"));
  EXPECT_EQ(begun(100), 100);
}

TEST_F(Tls, EventsGoOverIt) {
  TlsClient client(server_->address());
  ASSERT_TRUE(client.handshake());
  const std::string volume =
      nlohmann::json::parse(exchange(client, request("POST /v1/volumes", "voxels")).second).at("id");
  const std::string job =
      nlohmann::json::parse(
          exchange(client, request("POST /v1/jobs", nlohmann::json{{"volume", volume}}.dump(),
                                   "Content-Type: application/json\r\n"))
              .second)
          .at("id");
  ASSERT_TRUE(client.send(get("/v1/jobs/" + job + "/events")));
  EXPECT_NE(client.receive_until("\r\n0\r\n\r\n").find("succeeded"), std::string::npos);
  EXPECT_TRUE(exchange(client, get("/healthz")).first.starts_with("HTTP/1.1 200"));
}

TEST_F(Tls, GarbageInTheHandshakeEndsThatConnectionAlone) {
  for (int seed = 0; seed < 30; ++seed) {
    std::string bytes = "\x16";
    std::srand(static_cast<unsigned>(seed));
    for (int i = 0; i < 300; ++i) bytes += static_cast<char>(std::rand());
    HttpClient client(plain_address());
    client.send(bytes);
  }
  TlsClient client(server_->address());
  ASSERT_TRUE(client.handshake());
  EXPECT_TRUE(exchange(client, get("/healthz")).first.starts_with("HTTP/1.1 200"));
}

TEST_F(Tls, BothFilesAreNeededAndMustBeGood) {
  const auto refusal = [&](const std::filesystem::path& certificate, const std::filesystem::path& key) {
    ServerSettings wrong = settings();
    wrong.tls_certificate = certificate;
    wrong.tls_key = key;
    try {
      start(wrong);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal(identity_.certificate, ""), testing::HasSubstr("go together"));
  EXPECT_THAT(refusal("", identity_.key), testing::HasSubstr("go together"));
  EXPECT_THAT(refusal(folder_.path() / "missing", identity_.key),
              testing::HasSubstr("cannot use the TLS certificate"));
  EXPECT_THAT(refusal(identity_.certificate, identity_.certificate),
              testing::HasSubstr("cannot use the TLS key"));
}

/// Whoever reaches an open address must be known, and nobody on the way may listen.
TEST_F(Tls, AnOpenAddressNeedsItAndTokens) {
  const auto refusal = [&](bool with_tls) {
    ServerSettings open = with_tls ? settings() : ServerSettings{};
    open.listen = "0.0.0.0:0";
    try {
      start(open);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal(false), testing::HasSubstr("--tls-cert"));
  EXPECT_THAT(refusal(true), testing::HasSubstr("token"));
  jobs_.tokens().require();
  EXPECT_THAT(refusal(false), testing::HasSubstr("--tls-cert"));
  EXPECT_EQ(refusal(true), "");
}

}  // namespace
}  // namespace volsmooth
