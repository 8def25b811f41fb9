#!/usr/bin/env bash
# The main job on a real head: sets up a fresh Debian 12, builds, starts the daemon, smooths an MRI head by mean
# curvature flow and by the Laplacian of the same strength, and leaves volumes, surfaces, pictures and a report in
# demo-output/. Takes minutes the first time (packages, build), seconds afterwards.
set -euo pipefail
cd "$(dirname "$0")/.."
source client/setup.sh

head_file=/usr/share/mricron/templates/ch2.nii.gz
out=demo-output
packages=$(mktemp)
trap 'rm -f "$packages"' EXIT
printf '%s\n' bsdextrautils jq mricron-data >"$packages"
install_packages docker/build-packages.txt "$packages"

tests_off=(-DVOLSMOOTH_TESTS=OFF)
[[ -e build/CMakeCache.txt ]] && tests_off=()
build build "${tests_off[@]}" -- volsmoothd volsmooth

mkdir -p "$out"
data=$(mktemp -d)
build/bin/volsmoothd --listen 127.0.0.1:0 --data "$data" --ephemeral --log-level info 2>"$out/daemon.log" &
daemon=$!
trap 'rm -f "$packages"; kill "$daemon" 2>/dev/null || true; wait "$daemon" || true; rm -rf "$data"' EXIT
for _ in {1..100}; do
  url=$(sed -n 's/.*listening on \(http:[^ "]*\).*/\1/p' "$out/daemon.log" | head -1)
  [[ -n $url ]] && break
  kill -0 "$daemon" 2>/dev/null || { cat "$out/daemon.log" >&2; die "the daemon did not start; its log is above"; }
  sleep 0.1
done
[[ -n ${url:-} ]] || die "the daemon did not say where it listens within 10 seconds; see $out/daemon.log"

say "smoothing $head_file at $url"
build/bin/volsmooth smooth "$head_file" -o "$out" --server "$url" --method compare --feature-radius 2mm \
  --isovalue 40,90 --mesh stl,glb --force | sort >"$out/files.txt"

say "made in $out/"
sed 's/^/  /' "$out/files.txt"
printf '\nWhat the smoothing did (2 mm: balls of a smaller radius vanish):\n'
jq -r '
  def r(n): . * pow(10; n) | round / pow(10; n);
  (["method", "isovalue", "triangles", "area cm2", "-> after", "curvature rms /mm", "-> after", "moved mm (mean)"],
   (.surfaces[] | [.method, .isovalue, .triangles, (.area_mm2.before / 100 | r(1)), (.area_mm2.after / 100 | r(1)),
     (.curvature_per_mm.rms.before | r(3)), (.curvature_per_mm.rms.after | r(3)), (.displacement_mm.mean | r(3))])) | @tsv' \
  "$out/ch2_report.json" | column -t -s $'\t'
jq -r '"\nread \(.timing.read_seconds * 1000 | round) ms, flows \(.timing.flow_seconds * 1000 | round) ms, surfaces \(.timing.surface_seconds * 1000 | round) ms, writing \(.timing.write_seconds * 1000 | round) ms on \(.threads) threads"' "$out/ch2_report.json"
cat <<END

To look at it:
  $out/ch2_mean-curvature-flow.png     three slices before and after, with the isovalues as contours
  $out/ch2_mean-curvature-flow.glb     both surfaces (drop it on any glTF viewer; .stl beside it)
  $out/ch2_mean-curvature-flow.nii.gz  the smoothed head, for any NIfTI viewer
  $out/ch2_report.json                 every figure above, and more
END
