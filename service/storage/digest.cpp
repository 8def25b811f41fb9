#include "service/storage/digest.h"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>

#include <array>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "service/storage/block_sums.h"
#include "service/storage/posix.h"

namespace volsmooth {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

EVP_MD_CTX* as_context(void* pointer) {
  return static_cast<EVP_MD_CTX*>(pointer);
}

void require(int ok) {
  if (ok != 1) throw std::runtime_error("SHA-256 is not available");
}

}  // namespace

void Sha256::Free::operator()(void* context) const {
  EVP_MD_CTX_free(as_context(context));
}

std::string hex_of(std::span<const unsigned char> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  require(EVP_DigestInit_ex(as_context(context_.get()), EVP_sha256(), nullptr));
}

void Sha256::update(std::span<const std::byte> bytes) {
  require(EVP_DigestUpdate(as_context(context_.get()), bytes.data(), bytes.size()));
}

std::string Sha256::hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  require(EVP_DigestFinal_ex(as_context(context_.get()), digest.data(), &length));
  return hex_of({digest.data(), length});
}

std::string sha256_of(std::string_view text) {
  Sha256 sha256;
  sha256.update(std::as_bytes(std::span(text)));
  return sha256.hex();
}

bool is_same_digest(std::string_view one, std::string_view other) {
  return one.size() == other.size() && CRYPTO_memcmp(one.data(), other.data(), one.size()) == 0;
}

FileDigest digest_of(const std::filesystem::path& file, const std::function<void()>& between_blocks) {
  const FileDescriptor input = open_file(file, O_RDONLY);
  std::vector<std::byte> block(kBlockBytes);
  Sha256 sha256;
  BlockSums sums;
  FileDigest result;
  while (const std::size_t got = read_some(input, block)) {
    sha256.update(std::span(block).first(got));
    sums.update(std::span(block).first(got));
    result.bytes += static_cast<std::int64_t>(got);
    between_blocks();
  }
  result.sha256 = sha256.hex();
  result.block_sums = sums.text();
  return result;
}

}  // namespace volsmooth
