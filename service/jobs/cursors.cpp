#include "service/jobs/cursors.h"

#include <openssl/evp.h>

#include <array>
#include <charconv>
#include <memory>
#include <stdexcept>

#include "service/storage/digest.h"

namespace volsmooth {
namespace {

constexpr std::size_t kBlock = 16;
using Block = std::array<unsigned char, kBlock>;

/// One block of AES: the number and zeros, by which a block that we made is known.
Block crypt(const Block& block, const std::string& key, bool enciphers) {
  const std::unique_ptr<EVP_CIPHER_CTX, decltype(&EVP_CIPHER_CTX_free)> context(EVP_CIPHER_CTX_new(),
                                                                                &EVP_CIPHER_CTX_free);
  const auto bytes = reinterpret_cast<const unsigned char*>(key.data());
  Block out{};
  int length = 0;
  if (EVP_CipherInit_ex(context.get(), EVP_aes_256_ecb(), nullptr, bytes, nullptr, enciphers ? 1 : 0) != 1 ||
      EVP_CIPHER_CTX_set_padding(context.get(), 0) != 1 ||
      EVP_CipherUpdate(context.get(), out.data(), &length, block.data(), kBlock) != 1)
    throw std::runtime_error("AES is not available");
  return out;
}

/// 32 of the 64 hexadecimal digits: as many bits as a key of AES-128 has.
std::string key_of(const std::string& secret, std::string_view tenant) {
  return sha256_of(secret + std::string(tenant)).substr(0, 32);
}

}  // namespace

Cursors::Cursors(StoreDatabase& database)
    : secret_(database.read([](Database& reader) {
        Statement row = reader.query("SELECT value FROM secrets WHERE name = 'cursors'");
        row.step();
        return row.text(0);
      })) {}

std::string Cursors::at(std::string_view tenant, std::int64_t sequence) const {
  Block block{};
  for (std::size_t i = 0; i < sizeof sequence; ++i)
    block[i] = static_cast<unsigned char>(static_cast<std::uint64_t>(sequence) >> (8 * i));
  return hex_of(crypt(block, key_of(secret_, tenant), true));
}

std::optional<std::int64_t> Cursors::sequence_at(std::string_view tenant, std::string_view cursor) const {
  if (cursor.size() != 2 * kBlock) return std::nullopt;
  Block block{};
  for (std::size_t i = 0; i < kBlock; ++i) {
    const char* const digits = cursor.data() + 2 * i;
    if (std::from_chars(digits, digits + 2, block[i], 16).ptr != digits + 2) return std::nullopt;
  }
  const Block plain = crypt(block, key_of(secret_, tenant), false);
  std::uint64_t sequence = 0;
  for (std::size_t i = 0; i < kBlock; ++i) {
    if (i < sizeof sequence) sequence |= static_cast<std::uint64_t>(plain[i]) << (8 * i);
    if (i >= sizeof sequence && plain[i] != 0) return std::nullopt;
  }
  return static_cast<std::int64_t>(sequence);
}

}  // namespace volsmooth
