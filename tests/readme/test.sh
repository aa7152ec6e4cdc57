#!/usr/bin/env bash
# The two commands of README.md as a newcomer runs them, in a clone in a folder with spaces: ./demo.sh twice, ./test.sh --quick, and again after a
# source was touched. `root` runs them as root; `user` as a user who is made for it, and removed, and has no sudo. Packages are installed before, so
# that the scripts have nothing to ask. The commit is tested, not what is not committed. Needs root; takes 40 minutes on two cores without a compiler cache.
# usage: tests/readme/test.sh root|user
set -euo pipefail
root="$(cd "$(dirname "$0")/../.." && pwd)"
who="${1:-}"
case "$who" in root|user) ;; *) sed -n '2,6s/^# //p' "$0" >&2; exit 2 ;; esac
[ "$(id -u)" -eq 0 ] || { echo "tests/readme: needs root, to make a user and to install packages" >&2; exit 1; }
# shellcheck source=tools/packages.sh
source "$root/tools/packages.sh"
waymark_install "${WAYMARK_BUILD_PACKAGES[@]}" "${WAYMARK_TEST_PACKAGES[@]}"
command -v npm >/dev/null || waymark_install npm

scratch=$(mktemp -d)
chmod 755 "$scratch"
home="$scratch/home of $who"
name=root
finish() {
  if [ "$name" != root ]; then pkill -KILL -u "$name" || true; userdel "$name" || true; fi
  rm -rf --one-file-system "$scratch"
}
trap finish EXIT
mkdir -p "$home"
if [ "$who" = user ]; then
  useradd --no-log-init --home-dir "$home" --shell /bin/bash "waymark-newcomer"
  name=waymark-newcomer
  chown -R "$name:" "$home"
fi
as() { runuser -u "$name" -- env -i PATH=/usr/local/bin:/usr/bin:/bin HOME="$home" LC_ALL=C.UTF-8 USER="$name" bash -euo pipefail -c "$1" </dev/null; }
if [ "$who" = user ] && as "sudo -n true" 2>/dev/null; then echo "tests/readme: a new user may use sudo without a password here" >&2; exit 1; fi

git -C "$root" bundle create -q "$scratch/waymark.bundle" HEAD
as "git clone -q '$scratch/waymark.bundle' \"\$HOME/my clone\""
run() {  # run WHAT COMMAND: with its seconds, and its last lines where it fails
  local began=$SECONDS
  as "cd \"\$HOME/my clone\" && $2" >"$scratch/log" 2>&1 || { tail -60 "$scratch/log"; echo "tests/readme: as $who, $1: failed" >&2; exit 1; }
  echo "as $who, $1: $((SECONDS - began)) s; $(tail -1 "$scratch/log")"
}
run "demo.sh, first" "./demo.sh"
run "demo.sh, second" "./demo.sh"
run "demo.sh into a folder with a space" "./demo.sh 'my demo'"
run "test.sh --quick, first" "./test.sh --quick"
run "test.sh --quick after a source was touched" "touch waymark/geometry/se3.cpp && ./test.sh --quick"
changed=$(as "cd \"\$HOME/my clone\" && git status --porcelain --untracked-files=all -- ':!my demo'")
[ -z "$changed" ] || { echo "tests/readme: the commands leave files that git does not ignore:"$'\n'"$changed" >&2; exit 1; }
echo "readme, as $who: passed"
