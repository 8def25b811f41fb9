#!/usr/bin/env bash
# Usage: tests/proof/tls.sh VOLSMOOTHD [TESTSSL OPTION...]: has testssl look at the daemon's TLS for some ten minutes (with
# -p, -S and so on: at less) and fails when it finds anything that it ranks above low. The certificate is of the daemon's
# kind in a hospital: of an authority that says where it revokes.
set -euo pipefail
daemon=$(realpath "$1")
shift
work=$(mktemp -d)
trap 'kill "$pid" 2>/dev/null || true; wait; rm -rf "$work"' EXIT
cd "$work"

openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 90 -subj '/CN=proof authority' \
  -keyout ca.key -out ca.pem 2>/dev/null
openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj /CN=localhost -keyout key.pem -out request.pem 2>/dev/null
openssl x509 -req -in request.pem -CA ca.pem -CAkey ca.key -CAcreateserial -days 90 -out cert.pem 2>/dev/null -extfile <(
  printf '%s\n' subjectAltName=DNS:localhost,IP:127.0.0.1 extendedKeyUsage=serverAuth \
    crlDistributionPoints=URI:http://127.0.0.1:1/none.crl
)

"$daemon" --listen 127.0.0.1:0 --data data --tls-cert cert.pem --tls-key key.pem 2>daemon.log &
pid=$!
for _ in {1..100}; do
  address=$(sed -n 's/.*listening on https:\/\/\([^ "]*\).*/\1/p' daemon.log)
  [[ -n $address ]] && break
  sleep 0.1
done
[[ -n $address ]] || { cat daemon.log >&2; exit 1; }

testssl --quiet --color 0 --warnings off --add-ca ca.pem --jsonfile found.json "$@" "$address" || true
kill -0 "$pid" || { echo "the daemon did not outlive it" >&2; exit 1; }
jq -r '.[].severity' found.json | sort | uniq -c
jq -e '[.[] | select(.severity == "OK")] | length > 5' found.json >/dev/null || { echo "testssl saw nothing" >&2; exit 1; }
jq -e 'map(select(.severity | IN("MEDIUM", "HIGH", "CRITICAL", "FATAL"))) | (map("\(.severity): \(.id): \(.finding)") | .[]), length == 0' found.json | tail -20
