#include "service/http/digest_check.h"

#include <optional>
#include <set>
#include <span>
#include <string>

#include "service/http/ascii.h"
#include "service/storage/digest.h"

namespace volsmooth {
namespace {

constexpr std::size_t kSha256Digits = 64;

/// The bytes that `text` is the base64 of (RFC 4648, section 4), in hexadecimal; none when it is not.
std::optional<std::string> hex_of_base64(std::string_view text) {
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  while (text.ends_with('=')) text.remove_suffix(1);
  std::string hex;
  unsigned pending = 0;  // its lowest `bits` bits are not in `hex` yet
  int bits = 0;
  for (const char c : text) {
    const auto value = kAlphabet.find(c);
    if (value == std::string_view::npos) return std::nullopt;
    pending = (pending << 6 | static_cast<unsigned>(value)) & 0x3ff;
    for (bits += 6; bits >= 4; bits -= 4) hex += "0123456789abcdef"[pending >> (bits - 4) & 15];
  }
  return hex;
}

/// The digest in a member such as `sha-256=:dGVzdA==:` of a dictionary (RFC 8941, sections 3.2 and 3.3.5).
std::optional<std::string> digest_in(std::string_view member) {
  auto value = split(member.substr(member.find('=') + 1), ';').front();
  if (value.size() < 2 || !value.starts_with(':') || !value.ends_with(':')) return std::nullopt;
  auto hex = hex_of_base64(value.substr(1, value.size() - 2));
  if (!hex || hex->size() != kSha256Digits) return std::nullopt;
  return hex;
}

/// Every SHA-256 that the head promises, in hexadecimal; none when one of them cannot be one.
std::optional<std::set<std::string>> promised_digests(const Head& head) {
  std::set<std::string> promised;
  for (const HeaderField& field : head.fields) {
    if (field.name != "content-digest" && field.name != "repr-digest") continue;
    for (const auto member : split(field.value, ',')) {
      if (trimmed(member.substr(0, member.find('='))) != "sha-256") continue;
      const auto digest = digest_in(member);
      if (!digest) return std::nullopt;
      promised.insert(*digest);
    }
  }
  return promised;
}

class DigestedBody : public BodyReceiver {
 public:
  DigestedBody(std::unique_ptr<BodyReceiver> receiver, std::set<std::string> promised)
      : receiver_(std::move(receiver)), promised_(std::move(promised)) {}

  tl::expected<void, Problem> receive(std::string_view bytes) override {
    sha256_.update(std::as_bytes(std::span(bytes)));
    return receiver_->receive(bytes);
  }

  tl::expected<void, Problem> finish() override {
    const std::string received = sha256_.hex();
    for (const std::string& digest : promised_)
      if (digest != received)
        return tl::unexpected(Problem{"digest-mismatch",
                                      "What arrived has another SHA-256 than its digest field says; send it "
                                      "again, or correct the digest.",
                                      {{"received_sha256", received}}});
    return receiver_->finish();
  }

 private:
  std::unique_ptr<BodyReceiver> receiver_;
  const std::set<std::string> promised_;
  Sha256 sha256_;
};

}  // namespace

tl::expected<std::unique_ptr<BodyReceiver>, Problem> with_digest_check(
    const Head& head, std::unique_ptr<BodyReceiver> receiver) {
  auto promised = promised_digests(head);
  if (!promised)
    return tl::unexpected(
        Problem{"bad-header", "A digest by sha-256 must be the base64 of 32 bytes between colons."});
  if (promised->empty()) return receiver;
  return std::make_unique<DigestedBody>(std::move(receiver), *std::move(promised));
}

}  // namespace volsmooth
