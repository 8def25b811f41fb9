#!/usr/bin/env bash
# Sets up a fresh Debian 12, then runs every test: formatting, unit, architecture and system tests, and the unit tests
# again under the address and undefined-behaviour sanitizers. VOLSMOOTH_TEST_DATA may name a folder of real DICOM files
# (tests/algorithms/formats/dicom/real_data_test.cpp says which); no package of Debian has them.
set -euo pipefail
cd "$(dirname "$0")/.."
source client/setup.sh

install_packages docker/build-packages.txt tests/packages.txt

say "checking the formatting"
mapfile -t sources < <(find algorithms service client tests -name '*.h' -o -name '*.cpp')
clang-format --dry-run -Werror "${sources[@]}" || die "run: clang-format -i on the files above"

build build -DVOLSMOOTH_TESTS=ON
export VOLSMOOTH_SAMPLE_DATA=${VOLSMOOTH_SAMPLE_DATA:-/usr/share/mricron/templates}
[ -n "${VOLSMOOTH_TEST_DATA:-}" ] || say "VOLSMOOTH_TEST_DATA is not set: the tests of real DICOM files are skipped"
say "running the tests"
ctest --test-dir build --output-on-failure --no-tests=error -j "$(nproc)" || die "tests failed; each failure is printed above"

build build-sanitize -DVOLSMOOTH_TESTS=ON -DVOLSMOOTH_SANITIZE=address,undefined \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O1 -- unit_tests
say "running the unit tests under the sanitizers"
LSAN_OPTIONS=suppressions=$PWD/tests/leaks.supp ctest --test-dir build-sanitize --output-on-failure --no-tests=error -L unit -j "$(nproc)" || die "tests failed under the sanitizers; each failure is printed above"
