#!/bin/sh
# collect-runtime.sh ROOT PROGRAM...: makes ROOT the whole file system of an image that runs these programs: they,
# the shared libraries they load, certificates, a user of fixed number, and an empty /data that is the user's.
# Called by docker/Dockerfile, on Debian.
set -eu
root=$1
shift

copy() { cp --parents --dereference --no-preserve=ownership "$@" "$root"; }

mkdir -p "$root"
for program; do
  copy "$(command -v "$program")"
done
libraries=$(for program; do ldd "$(command -v "$program")"; done | grep -o '/[^ ]*' | sort -u)
# shellcheck disable=SC2086  # a list
copy $libraries /etc/os-release /etc/ssl/certs/ca-certificates.crt

# The packages the libraries come from, where image scanners look for them, and their licences.
status=$root/var/lib/dpkg/status.d
mkdir -p "$status"
for library in $libraries; do
  dpkg-query --search "*/$(basename "$(realpath "$library")")"
done | sed 's/:.*//' | sort -u | while read -r package; do
  dpkg-query --status "$package" >"$status/$package"
  copy "/usr/share/doc/$package/copyright"
done

# 10001 never changes, so that a host folder mounted on /data can be given to it for good.
echo 'volsmooth:x:10001:10001::/data:/' >"$root/etc/passwd"
echo 'volsmooth:x:10001:' >"$root/etc/group"
install -d -m 0700 -o 10001 -g 10001 "$root/data"
install -d -m 1777 "$root/tmp"
