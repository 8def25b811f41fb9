// proof_kills SHIM [KILLS [JOBS]]: kill -9 at random moments and at random system calls over many small jobs,
// uploads and deletions. Nothing may be lost, doubled or changed.
#include "tests/proof/cuts.h"

using namespace volsmooth::test;

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const int kills = argc > 2 ? std::stoi(argv[2]) : 500, jobs = argc > 3 ? std::stoi(argv[3]) : 10 * kills;
  const TemporaryDirectory directory;
  CuttableDaemon cuttable(argv[1], directory / "data");
  return Cutter(cuttable, {}).run(kills, jobs) == 0 ? 0 : 1;
}
