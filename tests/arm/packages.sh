#!/usr/bin/env bash
# Builds the Debian packages for 64-bit ARM with Debian's cross compiler, installs them in a clean Debian, runs `waymark demo` there under
# qemu-user, and removes them again. Compiler and libraries are installed in a separate Debian in build/arm/packaging (created once; needs root).
# Without the modules for ROS 2, Gazebo, boards and Python, whose libraries cannot be installed for two architectures at once.
# usage: tests/arm/packages.sh [OUT_FOLDER]       (default: build/arm/packages)
set -euo pipefail
case "${1:-}" in -h|--help) sed -n '2,5s/^# //p' "$0"; exit 0 ;; esac
root="$(cd "$(dirname "$0")/../.." && pwd)"
# shellcheck source=tools/packages.sh
source "$root/tools/packages.sh"
waymark_install mmdebstrap lintian file
fail() { echo "tests/arm/packages: $*" >&2; exit 1; }

here=(cmake ninja-build ccache pkg-config g++ g++-aarch64-linux-gnu python3 dpkg-dev file libeigen3-dev libexpected-dev libcli11-dev nlohmann-json3-dev)
there=(libfmt-dev libapriltag-dev libyaml-cpp-dev libjpeg62-turbo-dev libpng-dev libcairo2-dev libzstd-dev liblz4-dev libdeflate-dev libbz2-dev
  zlib1g-dev libsqlite3-dev libboost-dev libsdl2-dev liblcm-dev libavformat-dev libavcodec-dev libavutil-dev libgstreamer1.0-dev
  libgstreamer-plugins-base1.0-dev)
packages=$(IFS=,; echo "${here[*]},$(printf '%s:arm64,' "${there[@]}")")
system="$root/build/arm/packaging"
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
mirrors=()
for file in /etc/apt/sources.list /etc/apt/sources.list.d/{debian,ubuntu}.sources; do if [ -s "$file" ]; then mirrors+=("$file"); fi; done
debian() { mmdebstrap --quiet --variant=apt --mode=root --format=directory --architectures="$(dpkg --print-architecture),arm64" "$@"; }
if [ "$(cat "$system.packages" 2>/dev/null)" != "$packages" ]; then
  rm -rf --one-file-system "$system"
  mkdir -p "$root/build/arm"
  debian --include="${packages%,}" "$suite" "$system" "${mirrors[@]}"
  echo "$packages" >"$system.packages"
fi

[ -f "$root/build/viewer/dist/notices.txt.gz" ] || "$root/tools/build_viewer.sh"
clean=$(mktemp -d)
finish() {
  for place in "$system"/{src/waymark,proc,dev} "$clean"/system/{proc,dev}; do umount "$place" 2>/dev/null || true; done
  rm -rf --one-file-system "$clean"
}
trap finish EXIT
mkdir -p "$system/src/waymark" "$root/build/arm/ccache"
mount --bind "$root" "$system/src/waymark"
mount -t proc proc "$system/proc"
mount --bind /dev "$system/dev"
epoch=${SOURCE_DATE_EPOCH:-$(git -C "$root" log -1 --format=%ct)}
inside() {
  chroot "$system" env -i PATH=/usr/bin:/bin HOME=/root LC_ALL=C.UTF-8 TZ=UTC SOURCE_DATE_EPOCH="$epoch" CCACHE_DIR=/src/waymark/build/arm/ccache "$@"
}
build=/src/waymark/build/arm/package
inside cmake -S /src/waymark --preset package -B $build -DCMAKE_TOOLCHAIN_FILE=/src/waymark/cmake/aarch64.cmake -DWAYMARK_PYTHON=OFF \
  >"$root/build/arm/package.configure.log" 2>&1 || { cat "$root/build/arm/package.configure.log"; exit 1; }
inside cmake --build $build -j "$(nproc)" -- --quiet
rm -rf "$root/build/arm/package/packages"
# dpkg-shlibdeps looks for the libraries of the architecture that dpkg-architecture names.
inside sh -c "cd $build && dpkg-architecture -a arm64 -f -c cpack -G DEB" >"$root/build/arm/cpack.log" 2>&1 || { cat "$root/build/arm/cpack.log"; exit 1; }
out="${1:-$root/build/arm/packages}"
mkdir -p "$out"
cp "$root"/build/arm/package/packages/*.deb "$out/"
program=$(ls "$out"/waymark_*_arm64.deb) || fail "no package for arm64"
lintian --allow-root --fail-on error --tag-display-limit 0 "$out"/*_arm64.deb

debian --include=qemu-user "$suite" "$clean/system" "${mirrors[@]}"
cp /etc/resolv.conf "$clean/system/etc/"
mount -t proc proc "$clean/system/proc"
mount --bind /dev "$clean/system/dev"
there() { chroot "$clean/system" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
cp "$program" "$clean/system/tmp/"
there apt-get update -qq
there apt-get install -qq -y --no-install-recommends "/tmp/$(basename "$program")" >"$clean/install.log" 2>&1 || { cat "$clean/install.log"; fail "install"; }
file "$clean/system/usr/bin/waymark" | grep -q aarch64 || fail "the program is not for ARM: $(file "$clean/system/usr/bin/waymark")"
began=$SECONDS
there qemu-aarch64 /usr/bin/waymark demo -o /tmp/demo >"$clean/demo.log" 2>&1 || { cat "$clean/demo.log"; fail "demo"; }
grep -qE '^map +tags, rmse +0\.0[0-9]+ m' "$clean/demo.log" || { cat "$clean/demo.log"; fail "the demo's figures are missing"; }
echo "waymark demo under qemu-aarch64: $((SECONDS - began)) s; $(there qemu-aarch64 /usr/bin/waymark --version)"
there apt-get purge -qq -y --autoremove waymark:arm64 >"$clean/purge.log" 2>&1 || { cat "$clean/purge.log"; fail "purge"; }
[ -s "$clean/system/tmp/demo/lap.mcap" ] || fail "purge took what the user made"
[ ! -e "$clean/system/usr/bin/waymark" ] || fail "purge left the program"
ls -l "$out"
