#!/usr/bin/env bash
# Usage: tests/fuzz/run.sh [SECONDS [NAME...]]. Sets up a fresh Debian 12, builds the fuzz targets (all, or those named)
# with clang and runs each for that long (60 s) under the address and undefined-behaviour sanitizers. What it finds lies
# in build-fuzz/findings (leaks do not count: the child ends with its upload); inputs that reach new code in
# build-fuzz/corpus, where the next run goes on.
set -euo pipefail
cd "$(dirname "$0")/../.."
source client/setup.sh
seconds=${1:-60}
shift || true

install_packages docker/build-packages.txt tests/packages.txt tests/fuzz/packages.txt
names=("$@")
(($#)) || mapfile -t names < <(cd tests/fuzz && ls -- *_fuzz.cpp | sed 's/_fuzz.cpp//')
build build-fuzz -DVOLSMOOTH_FUZZ=ON -DVOLSMOOTH_TESTS=ON -DCMAKE_CXX_COMPILER=clang++-16 -DCMAKE_C_COMPILER=clang-16 \
  -- "${names[@]/#/fuzz_}"

export ASAN_OPTIONS=detect_leaks=0
mkdir -p build-fuzz/findings
for name in "${names[@]}"; do
  say "fuzzing $name for $seconds s"
  mkdir -p "build-fuzz/corpus/$name"
  dictionary=()
  [[ -f tests/fuzz/$name.dict ]] && dictionary=("-dict=tests/fuzz/$name.dict")
  "build-fuzz/bin/fuzz_$name" "${dictionary[@]}" -max_total_time="$seconds" -max_len=16384 -timeout=20 -rss_limit_mb=3000 \
    -print_final_stats=1 -artifact_prefix="build-fuzz/findings/$name-" "build-fuzz/corpus/$name" "tests/fuzz/corpus/$name" \
    2> >(grep -Ev '^#[0-9]+.(NEW|REDUCE|RELOAD)' >&2) || die "a finding: see build-fuzz/findings"
done
