#include "service/jobs/audit_seal.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>

#include <array>
#include <sstream>

namespace volsmooth {
namespace {

constexpr std::size_t kLineBytes = 96;  ///< always as many, so that the file never grows on a full disk

std::filesystem::path seal_of(std::filesystem::path database_file) {
  return database_file += ".audit";
}

AuditHead head_in(const FileDescriptor& file) {
  std::array<char, kLineBytes> bytes{};
  const std::size_t count = read_at(file, 0, std::as_writable_bytes(std::span(bytes)));
  std::istringstream line(std::string(bytes.data(), count));
  AuditHead head;
  line >> head.sequence >> head.hash;
  return head;
}

}  // namespace

AuditSeal::AuditSeal(const std::filesystem::path& database_file)
    : file_(open_file(seal_of(database_file), O_RDWR | O_CREAT)), last_(head_in(file_)) {}

void AuditSeal::write(const AuditHead& head) {
  std::string line = std::to_string(head.sequence) + " " + head.hash;
  line.resize(kLineBytes - 1, ' ');
  line += '\n';
  try {
    write_at(file_, 0, std::as_bytes(std::span(line)));
    last_ = head;
  } catch (const std::exception& error) {  // what it seals is committed; the next one seals both
    spdlog::error("the audit could not be sealed: {}", error.what());
  }
}

std::optional<AuditHead> AuditSeal::read(const std::filesystem::path& database_file) {
  if (!std::filesystem::exists(seal_of(database_file))) return std::nullopt;
  const AuditHead head = head_in(open_file(seal_of(database_file), O_RDONLY));
  if (head.sequence == 0) return std::nullopt;
  return head;
}

}  // namespace volsmooth
