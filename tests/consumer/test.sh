#!/usr/bin/env bash
# Installs the build into a scratch prefix, builds another program and the examples against find_package(Waymark), and runs them.
# usage: tests/consumer/test.sh BUILD_FOLDER CXX
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
root="$(cd "$here/../.." && pwd)"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cmake --install "$1" --prefix "$scratch/prefix" >/dev/null
# No flag of ours may reach the consumer, and no header that is not public.
if grep -rnE 'Werror|-Wall|fsanitize|_GLIBCXX_ASSERTIONS|waymark_warnings' "$scratch/prefix/lib"*/cmake "$scratch/prefix"/lib/*/cmake 2>/dev/null; then
  echo "the installed package exports flags of ours" >&2
  exit 1
fi
if ! diff <(cd "$scratch/prefix/include" && find waymark -type f | LC_ALL=C sort) <(grep '^waymark/' "$root/cmake/public_headers.txt" | LC_ALL=C sort); then
  echo "the installed headers (<) are not those of cmake/public_headers.txt (>)" >&2
  exit 1
fi
cmake -G Ninja -S "$here" -B "$scratch/build" -DCMAKE_CXX_COMPILER="$2" -DCMAKE_PREFIX_PATH="$scratch/prefix" -DCMAKE_BUILD_TYPE=Debug >/dev/null
cmake --build "$scratch/build" >"$scratch/build.log" || { cat "$scratch/build.log" >&2; exit 1; }
"$scratch/build/consumer"

# expect WORDS TEXT: an extended regular expression that must be in what an example printed.
expect() {
  grep -qE "$1" <<<"$2" || { echo "expected '$1' in: $2" >&2; exit 1; }
}
# The examples, on a lap that the installed program records: it finds the worlds and robots installed beside it.
waymark="$scratch/prefix/bin/waymark"
cd "$scratch"
"$waymark" teach --world circuit24 --seed 1 -o lap.mcap >/dev/null 2>&1
expect 'tag36h11:23: .* m' "$(build/map lap.mcap map 2>map.log)"
expect 'step [0-9]+, cost' "$(cat map.log)"
where=$(build/localize lap.mcap map)
expect ' s: x -?[0-9.]+ m, y -?[0-9.]+ m, yaw -?[0-9.]+ rad' "$where"
[ "$(wc -l <<<"$where")" -gt 500 ] || { echo "only $(wc -l <<<"$where") estimates" >&2; exit 1; }
expect '^done, 16[.][0-9]+ m of the route$' "$(build/own_robot map)"
# A printed sheet, 100 pixels an inch, before a camera of 1000 px focal length: 0.16 m are 630 px, so it is 0.254 m away.
"$waymark" tags sheet --ids 7 --tag-size-m 0.16 --paper A4 --dpi 100 -o sheet.png >/dev/null 2>&1
cat >camera.yaml <<END
image_width: 827
image_height: 1169
camera_name: sheet
camera_matrix: {rows: 3, cols: 3, data: [1000, 0, 413, 0, 1000, 584, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
END
expect '^tag 7: -?0.00[0-9] -?0.0[0-9]+ 0.25[34] m$' "$(build/detect sheet.png camera.yaml 0.16)"
build/own_robot nowhere >/dev/null 2>own.log && exit 1
expect 'nowhere' "$(cat own.log)"
words=$("$waymark" world check nowhere 2>&1) && exit 1
grep -qF "there is no 'nowhere' in $scratch/prefix/share/waymark/worlds" <<<"$words" || { echo "$words" >&2; exit 1; }
