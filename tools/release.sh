#!/usr/bin/env bash
# Makes a release of the sources as they are committed: all tests, packages, bill of materials, notes from CHANGELOG.md, checksums.
# usage: tools/release.sh [--check] [OUT_FOLDER]       (default: build/release-VERSION)
# --check: only looks whether the sources are ready (CHANGELOG.md, tests/golden/VERSION, nothing uncommitted), and prints the notes.
# Parts of ./test.sh --full that passed for the same sources are not run again. Nothing is published or tagged.
set -euo pipefail
cd "$(dirname "$0")/.."
check=""
case "${1:-}" in
  -h|--help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
  --check) check=1; shift ;;
esac
fail() { echo "release.sh: $*" >&2; exit 1; }

version=$(sed -n 's/^project(Waymark VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
[ -n "$version" ] || fail "CMakeLists.txt names no version: project(Waymark VERSION …"
out=${1:-build/release-$version}
notes=$(awk -v start="## $version:" '/^## /{inside = index($0, start) == 1} inside' CHANGELOG.md)
[ -n "$notes" ] || fail "CHANGELOG.md has no section '## $version: …'"
! grep -q '^Not released yet' <<<"$notes" || fail "CHANGELOG.md marks $version as 'Not released yet': replace it by the date"
for file in lap.mcap map/map.yaml symbols.txt; do
  [ -s "tests/golden/$version/$file" ] || fail "tests/golden/$version/$file is missing: later versions are held to it (tests/golden/README.md)"
done
changed=$(git status --porcelain)
[ -z "$changed" ] || fail "not committed:"$'\n'"$changed"
if [ -n "$check" ]; then printf '%s\n' "$notes"; exit 0; fi

mkdir -p build
./test.sh --full --require-data 2>&1 | tee build/release.log
tools/make_packages.sh "$out"
tests/arm/packages.sh "$out"
printf '%s\n\nCommit %s.\n' "$notes" "$(git rev-parse HEAD)" >"$out/RELEASE_NOTES.md"
sed -n '/^tests  /,$p' build/release.log >"$out/TESTS.txt"  # each part, its seconds and its date
(cd "$out" && rm -f SHA256SUMS && sha256sum -- * >SHA256SUMS && sha256sum --quiet --check SHA256SUMS)
ls -l "$out"
echo "release.sh: $version is in $out; to mark the commit: git tag -s v$version"
