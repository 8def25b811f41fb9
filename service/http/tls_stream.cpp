#include "service/http/tls_stream.h"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <stdexcept>

namespace volsmooth {
namespace {

namespace asio = boost::asio;
namespace ssl = boost::asio::ssl;
using boost::system::error_code;

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);

/// Of TLS 1.2; those of 1.3 are all good.
constexpr const char* kCiphers =
    "ECDHE-ECDSA-AES256-GCM-SHA384:ECDHE-RSA-AES256-GCM-SHA384:ECDHE-ECDSA-CHACHA20-POLY1305:"
    "ECDHE-RSA-CHACHA20-POLY1305:ECDHE-ECDSA-AES128-GCM-SHA256:ECDHE-RSA-AES128-GCM-SHA256";

[[noreturn]] void fail(const std::string& what, const std::filesystem::path& file, const error_code& why) {
  throw std::runtime_error("cannot use the TLS " + what + " " + file.string() + ": " + why.message());
}

/// Of the protocols that a client offers, HTTP/1.1 (RFC 7301); without it there is nothing to say.
int choose_protocol(SSL*, const unsigned char** chosen, unsigned char* length, const unsigned char* offered,
                    unsigned int offered_length, void*) {
  static constexpr unsigned char kOurs[] = "\x08http/1.1";
  unsigned char* found = nullptr;
  if (SSL_select_next_proto(&found, length, kOurs, sizeof kOurs - 1, offered, offered_length) !=
      OPENSSL_NPN_NEGOTIATED)
    return SSL_TLSEXT_ERR_ALERT_FATAL;
  *chosen = found;
  return SSL_TLSEXT_ERR_OK;
}

void set_rules(SSL_CTX* context) {
  const bool set = SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) == 1 &&
                   SSL_CTX_set_cipher_list(context, kCiphers) == 1 &&
                   SSL_CTX_set1_groups_list(context, "X25519:P-256:P-384") == 1;
  if (!set) throw std::runtime_error("this OpenSSL does not know what TLS is to use here");
  // No resumption: a key that could open recorded sessions would have to be kept.
  SSL_CTX_set_options(context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_TICKET |
                                   SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_num_tickets(context, 0);
  SSL_CTX_set_alpn_select_cb(context, choose_protocol, nullptr);
}

}  // namespace

struct TlsIdentity::State {
  ssl::context context{ssl::context::tls_server};
};

TlsIdentity::TlsIdentity(const std::filesystem::path& certificate, const std::filesystem::path& key)
    : state_(std::make_unique<State>()) {
  ssl::context& context = state_->context;
  set_rules(context.native_handle());
  error_code error;
  context.use_certificate_chain_file(certificate.string(), error);
  if (error) fail("certificate", certificate, error);
  // Also refuses a key that is not the certificate's.
  context.use_private_key_file(key.string(), ssl::context::pem, error);
  if (error) fail("key", key, error);
}

TlsIdentity::~TlsIdentity() = default;

struct TlsStream::State {
  ssl::stream<Socket&> stream;
};

TlsStream::TlsStream(Socket& socket, const TlsIdentity& identity)
    : state_(new State{ssl::stream<Socket&>(socket, identity.state_->context)}) {}

TlsStream::~TlsStream() = default;

asio::awaitable<error_code> TlsStream::handshake() {
  const auto [error] = co_await state_->stream.async_handshake(ssl::stream_base::server, kAwait);
  co_return error;
}

asio::awaitable<TlsStream::Outcome> TlsStream::read_some(asio::mutable_buffer into) {
  co_return co_await state_->stream.async_read_some(into, kAwait);
}

asio::awaitable<TlsStream::Outcome> TlsStream::write_some(asio::const_buffer from) {
  co_return co_await state_->stream.async_write_some(from, kAwait);
}

asio::awaitable<void> TlsStream::shutdown() {
  co_await state_->stream.async_shutdown(kAwait);
}

}  // namespace volsmooth
