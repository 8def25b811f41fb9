// volsmooth-dimse: speaks DIMSE with a peer for the daemon, in a sandbox. channel.h says what the two say to
// each other. 0: all was said; 2: called wrongly; 70: there is no sandbox; anything else: the peer was too
// much for it.

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmnet/dul.h>
#include <unistd.h>

#include <cstdlib>
#include <exception>
#include <string_view>
#include <system_error>

#include "service/dimse/channel.h"
#include "service/dimse/commands.h"
#include "service/dimse/dictionary.h"

namespace {

constexpr int kUsageError = 2, kGivenUp = 1, kInternal = 70;

/// All that DCMTK wants of the environment and of files.
void prepare() {
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  ::setenv("TCP_NODELAY", "1", 1);  // for DCMTK: without it, each of many small answers waits 40 ms
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
  if (command != "send" && command != "receive") return kUsageError;
  try {
    prepare();
    command == "send" ? volsmooth::send_instances() : volsmooth::receive_instances();
  } catch (const std::system_error&) {  // the sandbox's
    tell_our_fault();
    ::_exit(kInternal);
  } catch (const std::exception&) {
    ::_exit(kGivenUp);
  }
  ::_exit(0);  // nothing of what untrusted bytes made is run again
}
