#!/usr/bin/env bash
# Builds core rooms and their unit tests for 64-bit ARM with Debian's cross compiler, and runs them under qemu-user. Compiler, emulator and
# libraries of that architecture stand in a Debian of their own in build/arm/system (made once; needs root), so that the machine's packages
# stay as they are.
# usage: tests/arm/test.sh [ROOM ...]      (of the programs core, bytes and tags; default: base families geometry camera image codecs samples tags pose factors)
set -euo pipefail
case "${1:-}" in -h|--help) sed -n '2,5s/^# //p' "$0"; exit 0 ;; esac
root="$(cd "$(dirname "$0")/../.." && pwd)"
rooms=("${@:-}")
[ -n "${rooms[0]}" ] || rooms=(base families geometry camera image codecs samples tags pose factors)
# shellcheck source=tools/packages.sh
source "$root/tools/packages.sh"
waymark_install mmdebstrap

here=(cmake ninja-build ccache pkg-config g++ g++-aarch64-linux-gnu qemu-user python3 libeigen3-dev libexpected-dev libcli11-dev nlohmann-json3-dev)
there=(libfmt-dev libapriltag-dev libyaml-cpp-dev libjpeg62-turbo-dev libpng-dev libcairo2-dev libzstd-dev liblz4-dev libdeflate-dev libbz2-dev
  zlib1g-dev libsqlite3-dev libboost-dev libgtest-dev libgmock-dev librapidcheck-dev libopencv-calib3d-dev libopencv-imgproc-dev)
packages=$(IFS=,; echo "${here[*]},$(printf '%s:arm64,' "${there[@]}")")
system="$root/build/arm/system"
if [ "$(cat "$system.packages" 2>/dev/null)" != "$packages" ]; then
  rm -rf --one-file-system "$system"
  mkdir -p "$root/build/arm"
  mirrors=()
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/{debian,ubuntu}.sources; do if [ -s "$file" ]; then mirrors+=("$file"); fi; done
  mmdebstrap --quiet --variant=apt --mode=root --format=directory --architectures="$(dpkg --print-architecture),arm64" --include="${packages%,}" \
    "$(. /etc/os-release && echo "$VERSION_CODENAME")" "$system" "${mirrors[@]}"
  echo "$packages" >"$system.packages"
fi

mkdir -p "$system/src/waymark" "$root/build/arm/ccache"
finish() { for place in src/waymark proc dev; do umount "$system/$place" 2>/dev/null || true; done; }
trap finish EXIT
mount --bind "$root" "$system/src/waymark"
mount -t proc proc "$system/proc"
mount --bind /dev "$system/dev"
inside() { chroot "$system" env -i PATH=/usr/bin:/bin HOME=/root LC_ALL=C.UTF-8 CCACHE_DIR=/src/waymark/build/arm/ccache WAYMARK_FULL="${WAYMARK_FULL:-}" "$@"; }
targets=(waymark_core_tests waymark_bytes_tests waymark_tags_tests)  # cmake/TestPrograms.cmake: these hold the tests of the rooms
inside cmake -S /src/waymark -B /src/waymark/build/arm/build -G Ninja -DCMAKE_TOOLCHAIN_FILE=/src/waymark/cmake/aarch64.cmake -DCMAKE_BUILD_TYPE=None \
  -DCMAKE_CXX_FLAGS="-O1 -D_GLIBCXX_ASSERTIONS" -DWAYMARK_UNITY=ON -DWAYMARK_BUILD_EXAMPLES=OFF >"$root/build/arm/configure.log" 2>&1 ||
  { cat "$root/build/arm/configure.log"; exit 1; }
inside ninja -C /src/waymark/build/arm/build -j "$(nproc)" --quiet "${targets[@]}"
file=$(file -b "$root/build/arm/build/tests/${targets[0]}")
[[ "$file" == *aarch64* ]] || { echo "tests/arm: not built for ARM: $file" >&2; exit 1; }
labels=$(IFS='|'; echo "${rooms[*]}")
inside ctest --test-dir /src/waymark/build/arm/build -L "^($labels)$" --no-tests=error -j "$(nproc)" --timeout 3600 --output-on-failure >"$root/build/arm/tests.log" 2>&1 ||
  { grep -vE '^ *[0-9]+/[0-9]+ Test.*Passed|^ *Start ' "$root/build/arm/tests.log" | tail -60; exit 1; }
tail -4 "$root/build/arm/tests.log"
