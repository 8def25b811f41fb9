#!/usr/bin/env bash
# docker/try.sh [HEAD.nii.gz]: builds the image, runs it as compose.yaml does (read-only root, no capabilities), smooths
# a real head in it with the client, checks the files that come out, and removes all but the image and the layers it is
# built from. With Docker where its engine runs; else with podman, which is installed on Debian, and with a base image
# made by debootstrap should no registry be in reach. The head defaults to that of Debian's package mricron-data.
set -euo pipefail
head_file=$(realpath -m "${1:-/usr/share/mricron/templates/ch2.nii.gz}")
cd "$(dirname "$0")/.."
source client/setup.sh

image=volsmooth
container=volsmooth-try-$$
work=$(mktemp -d)
engine=(docker)
clean_up() {
  "${engine[@]}" rm --force "$container" >/dev/null 2>&1 || true
  "${engine[@]}" volume rm "$container" >/dev/null 2>&1 || true
  rm -rf "$work"
}
trap clean_up EXIT

need() {
  printf '%s\n' "$@" >"$work/packages"
  install_packages "$work/packages"
}

# Prints the local name of Debian's slim base image, made from the package archive.
debootstrapped_base() {
  local name=localhost/debian:bookworm-slim root=$work/root
  "${engine[@]}" image exists "$name" || {
    say "no registry in reach: making the base image from Debian's archive (a minute)"
    ((EUID == 0)) || die "debootstrap needs root: run this script with sudo"
    need debootstrap >&2
    debootstrap --variant=minbase bookworm "$root" >"$work/debootstrap.log" ||
      { tail -5 "$work/debootstrap.log" >&2; die "debootstrap failed; is deb.debian.org in reach?"; }
    # As this machine's apt reaches the archive (a proxy, say), so shall the one in the image.
    apt-config dump | grep '^Acquire::' >"$root/etc/apt/apt.conf.d/50host" || true
    tar -C "$root" --exclude='./var/cache/apt/*' --exclude='./var/lib/apt/lists/*' -c . |
      "${engine[@]}" import --quiet --change 'CMD ["bash"]' - "$name" >&2
    rm -rf "$root"
  }
  echo "$name"
}

build_with_podman() {
  local base=docker.io/library/debian:bookworm-slim
  "${engine[@]}" image exists "$base" || timeout 300 "${engine[@]}" pull --quiet "$base" >/dev/null 2>&1 ||
    base=$(debootstrapped_base)
  # The build trusts its own sources: chroot isolation works where nested containers do not.
  "${engine[@]}" build --isolation=chroot --network=host --pull-never --format=docker --layers --from "$base" \
    --file docker/Dockerfile --tag "$image" . >&2
}

healthy() {
  # podman leaves the health timer to systemd, which a small machine may not have: ask by hand.
  [[ ${engine[0]} == docker ]] || "${engine[@]}" healthcheck run "$container" >/dev/null 2>&1 || return 1
  [[ $("${engine[@]}" inspect --format '{{.State.Health.Status}}' "$container") == healthy ]]
}

wait_until_healthy() {
  for _ in {1..60}; do
    healthy && return
    [[ $("${engine[@]}" inspect --format '{{.State.Running}}' "$container") == true ]] || break
    sleep 1
  done
  "${engine[@]}" logs "$container" >&2
  die "the container did not become healthy within a minute; its log is above"
}

# status HOST [TARGET]: the HTTP status of the published port for a request with this Host header.
status() {
  local _ code
  exec 3<>"/dev/tcp/127.0.0.1/$port" || die "nothing listens on the published port $port"
  printf 'GET %s HTTP/1.1\r\nHost: %s\r\nConnection: close\r\n\r\n' "${2:-/healthz}" "$1" >&3
  read -r _ code _ <&3
  exec 3>&-
  echo "$code"
}

client() {
  "${engine[@]}" run --rm "${limits[@]}" "${locked[@]}" --network "container:$container" --user "$user" \
    --volume "$work:/work:z" --workdir /work --entrypoint volsmooth "$image" "$@" --server http://127.0.0.1:8742
}

run_daemon() {
  "${engine[@]}" run --detach --name "$container" "${limits[@]}" "${locked[@]}" --volume "$container:/data" \
    --publish 127.0.0.1::8742 "$image" >/dev/null || die "the container did not start; the line above says why"
  serving
}

serving() {
  wait_until_healthy
  port=$("${engine[@]}" port "$container" 8742/tcp | sed -n '1s/.*://p')
}

# refuse_strangers WHEN: nobody is let in without a token.
refuse_strangers() {
  local code
  code=$(status "127.0.0.1:$port" /v1/volumes)
  [[ $code == 401 ]] || die "a caller without a token got $code $1; 401 it was to be"
}

# number FILE OFFSET: the little-endian 32-bit number at this place.
number() { od -An -tu4 -j"$2" -N4 "$1" | tr -d ' '; }

check_files() {
  local expected=(ch2_{mean-curvature-flow,laplacian}.nii.gz ch2_{mean-curvature-flow,laplacian,original}.glb
    ch2_{mean-curvature-flow,laplacian,original}_iso{40,90}.stl ch2_report.json) file
  for file in "${expected[@]}"; do
    local path=$work/out/$file
    [[ -s $path ]] || die "the client was to leave $file, but did not"
    case $file in
      *.gz) gzip --test "$path" ;;
      *.stl) (($(stat -c %s "$path") == 84 + 50 * $(number "$path" 80))) ;;
      *.glb) [[ $(head -c 4 "$path") == glTF ]] && (($(stat -c %s "$path") == $(number "$path" 8))) ;;
      *.json) grep -q '"foliation"' "$path" ;;
    esac || die "$file is damaged"
  done
}

# --- The image

[[ -r $head_file ]] || need mricron-data
[[ -r $head_file ]] || die "there is no $head_file"
mkdir "$work/out"
cp "$head_file" "$work/ch2.nii.gz"

locked=(--read-only --tmpfs /tmp --cap-drop ALL --security-opt no-new-privileges)
limits=()
user=$(id -u):$(id -g)
if command -v docker >/dev/null && docker info >/dev/null 2>&1; then
  say "building the image $image with Docker (the first time takes minutes)"
  docker build --file docker/Dockerfile --tag "$image" . >&2 ||
    die "docker build failed; the lines above say why (does Docker reach its registry and deb.debian.org?)"
else
  need podman runc uidmap slirp4netns containernetworking-plugins iptables
  engine=(podman --runtime runc --log-level fatal)
  user=0:0 # without root, podman's 0 is who calls it
  # podman's own defaults are above what a container may set inside a container.
  limits=(--ulimit nofile=16384:16384 --ulimit nproc=8192:8192)
  [[ -d /run/systemd/system ]] || locked+=(--health-interval disable)
  say "building the image $image with podman (the first time takes minutes)"
  build_with_podman || die "podman build failed; the lines above say why"
fi

# --- At work

say "running it: read-only, without capabilities, on a port of this machine only"
run_daemon
[[ $(status "127.0.0.1:$port") == 200 ]] || die "the published port 127.0.0.1:$port did not answer /healthz with 200"
[[ $(status elsewhere.example) == 4?? ]] || die "a foreign Host header was served; it is to be refused"
refuse_strangers "before there is a token"
"${engine[@]}" exec "$container" volsmoothd token create --name try --scope read,submit >"$work/token" ||
  die "no token could be made; the line above says why"

label=$("${engine[@]}" image inspect --format '{{index .Config.Labels "org.opencontainers.image.version"}}' "$image")
[[ $(client --version) == *" $label" ]] ||
  die "docker/Dockerfile labels the image $label, but it holds $(client --version): set its label"

say "smoothing $head_file"
client smooth ch2.nii.gz -o out --token-file token --method compare --feature-radius 2mm --isovalue 40,90 --mesh stl,glb ||
  die "the client failed in the container; its line above says why"
check_files

say "stopping it and starting it again: what it holds is in the volume"
kept=$(client upload ch2.nii.gz --token-file token --json | sed -n 's/.*"id": *"\([^"]*\)".*/\1/p')
"${engine[@]}" stop -t 30 "$container" >/dev/null
ended=$("${engine[@]}" inspect --format '{{.State.ExitCode}}' "$container")
((ended == 0)) || die "SIGTERM was to end the daemon with 0, not $ended"
"${engine[@]}" start "$container" >/dev/null
serving
[[ -n $kept && $(client volumes --token-file token) == *"$kept"* ]] ||
  die "the volume uploaded before the restart is gone"
refuse_strangers "after the restart"

say "losing its volume: nobody is let in for that"
"${engine[@]}" rm --force "$container" >/dev/null
"${engine[@]}" volume rm "$container" >/dev/null
run_daemon
refuse_strangers "when the volume was lost"

say "all is well"
printf '%s files, image %s, %s MB\n' "$(find "$work/out" -type f | wc -l)" "$image" \
  $(($("${engine[@]}" image inspect --format '{{.Size}}' "$image") / 1000000))
