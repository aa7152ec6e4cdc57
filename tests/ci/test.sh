#!/usr/bin/env bash
# The public checks without GitHub: the lines of .github/workflows/ci.yml, one after the other as root in a clean Debian, with the commit in place of
# the checkout. Needs root (mmdebstrap, chroot), a network, 8 GB in TMPDIR, and the time given in README. usage: tests/ci/test.sh
set -euo pipefail
root="$(cd "$(dirname "$0")/../.." && pwd)"
# shellcheck source=tools/packages.sh
source "$root/tools/packages.sh"
waymark_install mmdebstrap python3-yaml
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
mirrors=()
for file in /etc/apt/sources.list /etc/apt/sources.list.d/{debian,ubuntu}.sources; do if [ -s "$file" ]; then mirrors+=("$file"); fi; done

scratch=$(mktemp -d)
finish() {
  local place
  for place in dev/shm dev proc; do umount "$scratch/system/$place" 2>/dev/null || true; done
  rm -rf --one-file-system "$scratch"
}
trap finish EXIT
mmdebstrap --quiet --variant=apt --mode=root --format=directory "$suite" "$scratch/system" "${mirrors[@]}"
cp /etc/resolv.conf "$scratch/system/etc/"
mkdir -p "$scratch/system/work" "$root/build"
mount -t proc proc "$scratch/system/proc"
mount --bind /dev "$scratch/system/dev"
mount -t tmpfs tmpfs "$scratch/system/dev/shm"
inside() {  # inside COMMAND: by the shell that the runner uses in a container, and with its variables
  chroot "$scratch/system" env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root CI=true GITHUB_ACTIONS=true \
    sh -e -c "cd /work && $1" </dev/null
}
git -C "$root" bundle create -q "$scratch/system/waymark.bundle" HEAD
mapfile -t lines < <(/usr/bin/python3 "$root/tests/ci/workflow.py")
[ "${#lines[@]}" -gt 3 ] || { echo "tests/ci: the workflow runs nothing" >&2; exit 1; }
for line in "${lines[@]}"; do
  began=$SECONDS
  case "$line" in
    actions/checkout) command="git clone -q --depth 2 file:///waymark.bundle . || git clone -q /waymark.bundle ." ;;
    *) command="$line" ;;
  esac
  inside "$command" >"$root/build/ci.log" 2>&1 || { tail -80 "$root/build/ci.log"; echo "tests/ci: failed: $line" >&2; exit 1; }
  echo "$line: $((SECONDS - began)) s; $(tail -1 "$root/build/ci.log")"
done
echo "ci: passed"
