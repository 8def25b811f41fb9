#include "service/dimse/sandbox.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "service/process/confinement.h"

namespace volsmooth {
namespace {

struct SocketOption {
  unsigned level, option;
};

/// Those that DCMTK sets.
constexpr SocketOption kSocketOptions[] = {
    {SOL_SOCKET, SO_REUSEADDR}, {SOL_SOCKET, SO_LINGER},   {SOL_SOCKET, SO_SNDBUF},   {SOL_SOCKET, SO_RCVBUF},
    {SOL_SOCKET, SO_SNDTIMEO},  {SOL_SOCKET, SO_RCVTIMEO}, {IPPROTO_TCP, TCP_NODELAY}};

}  // namespace

void enter_sandbox(std::int64_t address_space_bytes) {
  SystemCalls calls;
  calls.allow({SCMP_SYS(recvfrom), SCMP_SYS(sendto), SCMP_SYS(shutdown), SCMP_SYS(getsockopt),
               SCMP_SYS(getpeername), SCMP_SYS(getsockname), SCMP_SYS(poll), SCMP_SYS(ppoll),
               SCMP_SYS(select), SCMP_SYS(pselect6), SCMP_SYS(time), SCMP_SYS(getpid)});
  // A descriptor that has an owner and O_ASYNC signals any process of the same user.
  for (const unsigned command : {F_GETFL, F_GETFD, F_SETFD})
    calls.allow(SCMP_SYS(fcntl), SCMP_A1(SCMP_CMP_EQ, command));
  calls.allow(SCMP_SYS(fcntl), SCMP_A1(SCMP_CMP_EQ, F_SETFL), SCMP_A2(SCMP_CMP_MASKED_EQ, O_ASYNC, 0));
  for (const auto& [level, option] : kSocketOptions)
    calls.allow(SCMP_SYS(setsockopt), SCMP_A1(SCMP_CMP_EQ, level), SCMP_A2(SCMP_CMP_EQ, option));
  confine({.address_space_bytes = address_space_bytes}, calls);
}

}  // namespace volsmooth
