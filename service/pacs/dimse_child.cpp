#include "service/pacs/dimse_child.h"

#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <vector>

#include "service/process/check.h"
#include "service/process/spawn.h"

namespace volsmooth {
namespace {

constexpr std::chrono::seconds kGrace{5};

/// Both are closed on exec; the child gets copies.
std::array<FileDescriptor, 2> socket_pair() {
  int ends[2];
  check(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0, "a socket pair");
  return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

}  // namespace

std::filesystem::path dimse_program() {
  auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "volsmooth-dimse";
  if (std::filesystem::exists(program)) return program;
  throw std::runtime_error("DIMSE needs volsmooth-dimse beside this program, and it is not there");
}

DimseChild::DimseChild(const char* command, int connection) {
  auto [ours, its] = socket_pair();
  std::vector<int> descriptors{its.get(), -1, -1};
  static_assert(kChannelDescriptor == 0 && kConnectionDescriptor == 3);
  if (connection >= 0) descriptors.push_back(connection);
  process_ = spawn(dimse_program(), command, descriptors);
  socket_ = std::move(ours);
}

DimseChild::~DimseChild() {
  kill();
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) continue;
}

void DimseChild::kill() const {
  ::kill(process_, SIGKILL);  // it is not reaped before this object ends, so the number is still its
}

void DimseChild::finish() {
  ::shutdown(socket_.get(), SHUT_WR);
  try {
    while (channel().receive(kGrace)) continue;
  } catch (const ChannelError&) {  // it is killed
  }
}

}  // namespace volsmooth
