// measure_tenants [TRIES]: so many calls (20,000) by one tenant that name what is another's; prints how many
// answers differed from those for what never was.
#include <cstdio>

#include "tests/system/tenants.h"

using namespace volsmooth::test;

namespace {

std::string make_token(const Daemon& daemon, const std::string& tenant) {
  const TemporaryDirectory folder;
  ChildProcess({VOLSMOOTHD, "token", "create", "--data", daemon.data().string(), "--name", tenant, "--scope",
                "admin", "--tenant", tenant},
               folder / "out", folder / "err")
      .wait();
  const std::string text = content_of(folder / "out");
  return text.substr(0, text.find('\n'));
}

}  // namespace

int main(int argc, char** argv) {
  const int tries = argc > 1 ? std::stoi(argv[1]) : 20'000;
  const Daemon daemon(VOLSMOOTHD);
  TwoTenants tenants(daemon, make_token(daemon, "ward-a"), make_token(daemon, "ward-b"));
  const int leaks = tenants.leaks(tries, 20261126);
  const bool untouched = tenants.is_untouched();
  std::printf("%d calls across tenants: %d leaks; the owner's things are %s\n", tries, leaks,
              untouched ? "as they were" : "CHANGED");
  return leaks == 0 && untouched ? 0 : 1;
}
