#!/usr/bin/env bash
# Builds Waymark (installing what it needs) and shows what it can do, without any hardware. See --help.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")"

usage() {
  cat <<'TXT'
usage: ./demo.sh [--laps N] [--package FILE.deb] [OUT_DIR]          (default: one lap driven again; out/demo)

Installs the Debian packages it needs (prints their names; asks before sudo), builds the release preset (and, where there is npm, the page of
`waymark view`), then
  1. teaches a simulated robot a lap on rendered images, makes a map of it, lets the robot drive it again, and compares with the truth,
  2. renders a photograph of tags whose true corners are known,
  3. finds them, and leaves an annotated image,
  4. compares with the truth,
  5. prints a sheet with a tag, photographs it virtually, and reports its pose beside the truth.
The second run takes seconds. With --package nothing is built: the package is installed, and the first step is run.
TXT
}
laps=1; deb=""
while [ $# -gt 0 ]; do
  case "$1" in
    --laps) laps="${2:?--laps needs a number}"; shift ;;
    --package) deb="$(cd "$from" && realpath -m -- "${2:?--package needs the file of a package}")"; shift ;;
    -h|--help) usage; exit 0 ;;
    -*) echo "demo.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
    *) break ;;
  esac
  shift
done
out="${1:-out/demo}"
quoted=$(printf %q "$out")  # for commands that can be copied
# shellcheck source=tools/packages.sh
source tools/packages.sh

if [ -n "$deb" ]; then
  [ -f "$deb" ] || { echo "demo.sh: there is no package '$deb'" >&2; exit 2; }
  echo "\$ apt-get install $(printf %q "$deb")"
  log=$(mktemp)
  waymark_apt "$log" install -y --no-install-recommends "$deb"
  rm -f "$log"
  exec waymark demo --images --laps "$laps" -o "$out/loop"
fi

waymark_install "${WAYMARK_BUILD_PACKAGES[@]}"
export CCACHE_BASEDIR="$PWD" CCACHE_NOHASHDIR=1
mkdir -p build "$out"
if command -v npm >/dev/null; then  # the page of `waymark view`; without it the program explains how to get it
  tools/build_viewer.sh || echo "demo.sh: the page of waymark view is not built"
fi
[ -f build/release/build.ninja ] || echo "Building: the first time takes about eight minutes on two cores."
compiler=()
if command -v clang++-16 >/dev/null; then compiler=(-DCMAKE_CXX_COMPILER=clang++-16); fi  # two thirds of GCC's time
cmake --preset release "${compiler[@]}" -DWAYMARK_WERROR=OFF -DWAYMARK_BUILD_BENCHMARKS=OFF -DWAYMARK_UNITY=ON >build/release.configure.log 2>&1 ||
  { cat build/release.configure.log; exit 1; }
NINJA_STATUS="[%f of %t, %es] " cmake --build --preset release -j "$(nproc)" --target waymark waymark_photograph waymark_photograph_sheet
waymark=build/release/bin/waymark

echo
echo "1. \$ waymark demo --images --laps $laps -o $quoted/loop"
"$waymark" demo --images --laps "$laps" -o "$out/loop"
echo
echo "2. A photograph of tags, with blur and noise:  $out/photograph.png"
build/release/examples/waymark_photograph "$out"
echo
echo "3. \$ waymark detect --annotate $quoted/annotated $quoted/photograph.png"
"$waymark" detect --annotate "$out/annotated" "$out/photograph.png"
echo
echo "4. \$ waymark evaluate detections --truth $quoted/truth.csv $quoted/photograph.png"
"$waymark" evaluate detections --truth "$out/truth.csv" "$out/photograph.png"
echo
echo "5. \$ waymark tags sheet --ids 7 --tag-size-m 0.16 --paper A4 -o $quoted/sheet.pdf     (print this one on paper)"
# The folder sheet is made before the sheets: where it is, they are of an earlier run, and are replaced. Sheets of other origin are not.
if [ ! -e "$out/sheet.pdf" ] && [ ! -e "$out/sheet.png" ]; then mkdir -p "$out/sheet"; fi
replace=(); if [ -d "$out/sheet" ]; then replace=(--force); fi
"$waymark" tags sheet --ids 7 --tag-size-m 0.16 --paper A4 "${replace[@]}" -o "$out/sheet.pdf"
"$waymark" tags sheet --ids 7 --tag-size-m 0.16 --paper A4 --dpi 300 "${replace[@]}" -o "$out/sheet.png"
echo
build/release/examples/waymark_photograph_sheet "$out/sheet.png" "$out/sheet"
echo "\$ waymark detect --camera $quoted/sheet/camera.yaml --tag-size-m 0.16 $quoted/sheet/sheet_photo.png"
"$waymark" detect --camera "$out/sheet/camera.yaml" --tag-size-m 0.16 --annotate "$out/annotated" "$out/sheet/sheet_photo.png"

echo
echo "Look at it: $out/loop/report.html, $out/annotated/, or in the browser: $waymark view $quoted/loop"
echo "The program:  export PATH=\"$PWD/build/release/bin:\$PATH\""
