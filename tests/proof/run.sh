#!/usr/bin/env bash
# Usage: tests/proof/run.sh [kills|faults|power|model|many|load|slow|tenants|tls [N]]. Sets up a fresh Debian 12,
# builds, and runs the long form of all proofs of what the daemon promises, or of the one that is named:
#   kills [N]   kill -9, N (500) times over 10 N small jobs
#   faults [N]  an error at every N-th (1) call on the data directory
#   power [N]   N (50) power cuts over 10 N small jobs; needs the right to mount
#   model [N]   N (20,000) random operations on the jobs, beside a model of them
#   many [N]    a store of N (100,000) finished jobs
#   load [N]    N (100,000) requests by 64 clients beside running jobs
#   slow [N]    2,000 connections that are as slow as they can be, for N (300) seconds
#   tenants [N] N (20,000) tries to get at what is another tenant's
#   tls         testssl looks at the daemon (ten minutes)
set -euo pipefail
cd "$(dirname "$0")/../.."
source client/setup.sh
install_packages docker/build-packages.txt tests/packages.txt
build build -DVOLSMOOTH_TESTS=ON -- proof_kills proof_faults proof_power test_service_jobs \
  measure_many_jobs measure_load measure_slow_clients measure_tenants

shim=$PWD/build/tests/proof/libfault_shim.so
prove() {
  say "$1"
  case $1 in
    kills) build/bin/proof_kills "$shim" "${2:-500}" ;;
    faults) build/bin/proof_faults "$shim" "${2:-1}" ;;
    power) build/bin/proof_power "$shim" "${2:-50}" || (($? == 77)) ;;
    model) VOLSMOOTH_TEST_STEPS=${2:-20000} build/bin/test_service_jobs --gtest_filter='JobModel.*' ;;
    many) build/bin/measure_many_jobs "${2:-100000}" ;;
    load) build/bin/measure_load "${2:-100000}" ;;
    slow) build/bin/measure_slow_clients 2000 "${2:-300}" ;;
    tenants) build/bin/measure_tenants "${2:-20000}" ;;
    tls) tests/proof/tls.sh build/bin/volsmoothd "${@:2}" ;;
    *) die "there is no proof '$1'" ;;
  esac
}
if (($#)); then
  prove "$@"
else
  for name in kills faults power model many load slow tenants tls; do prove "$name"; done
fi
