#!/usr/bin/env bash
# Sourced by client/demo.sh and tests/run.sh: installs what is missing and builds, saying what it does.

say() { printf '\n== %s\n' "$*" >&2; }
die() {
  printf '\nvolsmooth: %s\n' "$*" >&2
  exit 1
}

# install_packages FILE...: apt-installs the packages listed in the files that are not there yet.
install_packages() {
  command -v dpkg-query >/dev/null || die "this script sets up Debian 12; elsewhere, install what docker/build-packages.txt lists and build with CMake (README.md, Build by hand)"
  local wanted missing=() name
  wanted=$(sed -e 's/#.*//' "$@" | xargs)
  for name in $wanted; do
    dpkg-query -W -f='${Status}' "$name" 2>/dev/null | grep -q '^install ok installed$' || missing+=("$name")
  done
  ((${#missing[@]})) || return 0

  say "installing ${#missing[@]} packages: ${missing[*]}"
  local as_root=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || die "packages are missing and there is no sudo; as root, run: apt-get install --no-install-recommends ${missing[*]}"
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get update -q || die "apt-get update failed; is the network up?"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" ||
    die "apt-get could not install the packages above; volsmooth builds on Debian 12 (bookworm)"
}

# build DIRECTORY CMAKE-OPTIONS... [-- TARGET...]: configures when needed, then builds.
build() {
  local directory=$1 options=()
  shift
  while (($#)) && [[ $1 != -- ]]; do
    options+=("$1")
    shift
  done
  (($#)) && shift
  # So that every clone can use what one has compiled, also with a precompiled header.
  export CCACHE_NOHASHDIR=1 CCACHE_BASEDIR=$PWD CCACHE_SLOPPINESS=pch_defines,time_macros
  say "building in $directory (the first time takes minutes)"
  local log
  # In a unity build the headers are compiled once for eight sources: half the time.
  log=$(cmake -S . -B "$directory" -G Ninja -DCMAKE_UNITY_BUILD=ON "${options[@]}" 2>&1) ||
    { printf '%s\n' "$log" >&2; die "configuring failed; the lines above say why"; }
  cmake --build "$directory" ${@:+--target "$@"} >&2 || die "building failed; the lines above say why"
}
