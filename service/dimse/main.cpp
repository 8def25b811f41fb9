// volsmooth-dimse: speaks DIMSE with a peer for the daemon, in a sandbox. channel.h says what the two say to
// each other. 0: all was said; 2: called wrongly; 70: there is no sandbox; anything else: the peer was too
// much for it.

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmnet/dul.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <string_view>
#include <system_error>
#include <utility>

#include "service/dimse/channel.h"
#include "service/dimse/commands.h"
#include "service/dimse/dictionary.h"

namespace {

constexpr int kUsageError = 2, kGivenUp = 1, kInternal = 70;

/// All that DCMTK and OpenSSL want of the environment and of files.
void prepare() {
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  ::setenv("TCP_NODELAY", "1", 1);  // for DCMTK: without it, each of many small answers waits 40 ms
  ::tzset();
  dcmDisableGethostbyaddr.set(OFTrue);
  volsmooth::use_command_dictionary();
}

/// So that the daemon does not think that the peer broke off.
void tell_our_fault() {
  try {
    volsmooth::Channel(volsmooth::kChannelDescriptor).send({{"failure", "internal"}});
  } catch (const std::exception&) {  // it is gone
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view command = argc == 2 ? argv[1] : "";
  constexpr std::pair<std::string_view, void (*)()> kCommands[] = {{"send", volsmooth::send_instances},
                                                                   {"receive", volsmooth::receive_instances},
                                                                   {"check-tls", volsmooth::check_tls}};
  const auto* const found =
      std::ranges::find(kCommands, command, &std::pair<std::string_view, void (*)()>::first);
  if (found == std::end(kCommands)) return kUsageError;
  try {
    prepare();
    found->second();
  } catch (const std::system_error&) {  // the sandbox's
    tell_our_fault();
    ::_exit(kInternal);
  } catch (const std::exception&) {
    ::_exit(kGivenUp);
  }
  ::_exit(0);  // nothing of what untrusted bytes made is run again
}
