#!/usr/bin/env bash
# readme_test.sh README BUILD [MARK [SED]]: runs the README's command blocks in order, in one shell and a fresh
# directory in which build/ is the given one. A block counts when the line before its ```sh fence is <!-- MARK -->; the
# default is "tested". Port 8742 is replaced by a free one, so that a daemon of the machine's own is not in the way, and
# whatever the sed commands replace: what stands for a place of the reader's own.
set -euo pipefail

readme=$(realpath "$1")
build=$(realpath "$2")
mark=${3:-tested}
[[ -e $readme ]] || exit 77
if [[ $mark == tested ]]; then
  [[ -e /usr/share/mricron/templates/ch2.nii.gz ]] || { echo "no ch2.nii.gz (package mricron-data): skipped"; exit 77; }
else
  export PATH="$build/bin:$PATH" # as the first block leaves it
fi

directory=$(mktemp -d)
trap 'rm -rf "$directory"' EXIT
cd "$directory"
ln -s "$build" build

free_port=$(shuf -i 20000-29999 -n 1)
while (exec 3<>"/dev/tcp/127.0.0.1/$free_port") 2>/dev/null; do free_port=$(shuf -i 20000-29999 -n 1); done

{
  echo 'set -euxo pipefail'
  echo "trap 'kill \$(jobs -p) 2>/dev/null; wait' EXIT"
  awk -v mark="<!-- $mark -->" '
    /^```/ { if (inside) { inside = 0; next } if ($0 == "```sh" && tested) { inside = 1; blocks++; next } }
    inside
    { tested = $0 == mark }
    END { if (inside || !blocks) exit 1 }' "$readme" | sed -e "s/8742/$free_port/g" -e "${4:-}"
} >commands.sh || { echo "README.md has no block to test, or one that does not end"; exit 1; }

bash commands.sh
