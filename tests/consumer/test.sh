#!/usr/bin/env bash
# Installs the build into a scratch prefix and builds a stranger's project against find_package(Waymark).
# usage: tests/consumer/test.sh BUILD_FOLDER CXX
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cmake --install "$1" --prefix "$scratch/prefix" >/dev/null
# No flag of ours may reach the consumer.
if grep -rnE 'Werror|-Wall|fsanitize|_GLIBCXX_ASSERTIONS|waymark_warnings' "$scratch/prefix/lib"*/cmake "$scratch/prefix"/lib/*/cmake 2>/dev/null; then
  echo "the installed package exports flags of ours" >&2
  exit 1
fi
cmake -G Ninja -S "$here" -B "$scratch/build" -DCMAKE_CXX_COMPILER="$2" -DCMAKE_PREFIX_PATH="$scratch/prefix" -DCMAKE_BUILD_TYPE=Debug >/dev/null
cmake --build "$scratch/build" >/dev/null
"$scratch/build/consumer"
# The installed program finds the worlds and robots installed beside it, not those of the source tree.
words=$("$scratch/prefix/bin/waymark" world check nowhere 2>&1) && exit 1
grep -qF "$scratch/prefix/share/waymark/worlds: there is no 'nowhere'" <<<"$words" || { echo "$words" >&2; exit 1; }
"$scratch/prefix/bin/waymark" world check circuit24 >/dev/null
