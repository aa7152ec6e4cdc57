#!/usr/bin/env bash
# The Debian packages Waymark needs (the same names serve Ubuntu 24.04), and a function that installs what is missing.
# `tools/packages.sh` alone prints them; demo.sh and test.sh source it.

# To build and run the programs.
WAYMARK_BUILD_PACKAGES=(g++ clang-16 cmake ninja-build pkg-config ccache git libeigen3-dev libfmt-dev libexpected-dev libapriltag-dev
  libyaml-cpp-dev libcli11-dev nlohmann-json3-dev libjpeg-dev libpng-dev libcairo2-dev libzstd-dev liblz4-dev libdeflate-dev libbz2-dev
  zlib1g-dev libsqlite3-dev libboost-dev libavformat-dev libavcodec-dev libavutil-dev
  libgstreamer1.0-dev libgstreamer-plugins-base1.0-dev libfastrtps-dev liblcm-dev)
# Without libgstreamer*-dev no gstreamer: cameras, without libav*-dev no videos, without libfastrtps-dev no ROS 2, without liblcm-dev no MBot. Only where gamepads are wanted: libsdl2-dev.
# Only for chessboards, ChArUco boards and Kalibr's AprilGrids: libopencv-contrib-dev libopencv-calib3d-dev.
# Only for Gazebo Fortress: libignition-transport-dev libignition-msgs-dev; to read its worlds: libsdformat-dev libassimp-dev.
# Only for the Python package: pybind11-dev python3-dev python3-numpy.
# To test them as well: frameworks, oracles, sanitizers, linters.
WAYMARK_TEST_PACKAGES=(libsdl2-dev libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev libopencv-calib3d-dev
  libopencv-imgproc-dev libopencv-contrib-dev clang-tidy-16 clang-format-16 libclang-rt-16-dev python3 poppler-utils librsvg2-bin gcovr
  pybind11-dev python3-dev python3-numpy python3-pandas python3-opencv python3-yaml python3-venv python3-setuptools python3-wheel mypy
  python3-nbformat python3-nbclient python3-ipykernel mkdocs mkdocs-material doxygen
  libmujoco-dev liblcm-bin python3-rosbag python3-sensor-msgs python3-geometry-msgs python3-nav-msgs python3-tf2-msgs chromium
  gstreamer1.0-plugins-base ffmpeg cyclonedds-dev cyclonedds-tools openssl libxml2-utils g++-aarch64-linux-gnu qemu-user googletest
  libignition-transport-dev libignition-msgs-dev ignition-transport-cli libsdformat-dev libassimp-dev zstd)
# The pages that work in the browser (test.sh --full=site, tools/build_web.sh).
# shellcheck disable=SC2034  # used by scripts that source this file
WAYMARK_WEB_PACKAGES=(emscripten)
# A machine that has cameras and gamepads (test.sh --full=devices).
# shellcheck disable=SC2034  # used by scripts that source this file
WAYMARK_DEVICE_PACKAGES=(qemu-system-x86 busybox-static cpio kmod v4l-utils)

# waymark_apt LOG WORD...: apt-get as root, its output in the file LOG. Another program may hold a lock of apt or dpkg (an update in the
# background): it is waited for, ten minutes at most. DPkg::Lock::Timeout alone does not wait for the lock of `apt-get update`.
waymark_apt() {
  local log="$1" sudo=() began=$SECONDS announced=""
  shift
  [ "$(id -u)" -eq 0 ] || sudo=(sudo)
  until "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C apt-get -o DPkg::Lock::Timeout=20 "$@" >"$log" 2>&1; do
    if ! grep -q 'Could not get lock\|Unable to acquire the dpkg frontend lock\|Unable to lock' "$log" || [ $((SECONDS - began)) -ge 600 ]; then
      tail -20 "$log" >&2
      echo "apt-get $1 failed; the whole output is in $log" >&2
      return 1
    fi
    [ -n "$announced" ] || echo "Another program is installing packages. Waiting until it has finished, for 10 minutes at most ..." >&2
    announced=1
    sleep 5
  done
}

# waymark_unpack FOLDER PACKAGE...: the files of packages below a folder, for those that cannot be installed beside others. Needs no root where apt has
# its lists.
waymark_unpack() {
  local folder="$1" fetched package
  shift
  [ ! -d "$folder" ] || return 0
  fetched=$(mktemp -d)
  if (cd "$fetched" && apt-get -o DPkg::Lock::Timeout=600 download "$@") >"$fetched/log" 2>&1; then
    for package in "$fetched"/*.deb; do dpkg -x "$package" "$folder.part"; done
    mv "$folder.part" "$folder"
    rm -rf "$fetched"
  else
    cat "$fetched/log" >&2
    rm -rf "$fetched"
    return 1
  fi
}

# waymark_install PACKAGE...: prints what is missing, asks before sudo (not as root, not in CI), installs it.
waymark_install() {
  if ! command -v dpkg-query >/dev/null; then
    echo "This is not a Debian or Ubuntu system: install the equivalents of" >&2
    echo "  $*" >&2
    echo "and run again with WAYMARK_SKIP_INSTALL=1." >&2
    [ -n "${WAYMARK_SKIP_INSTALL:-}" ] && return 0
    return 1
  fi
  [ -n "${WAYMARK_SKIP_INSTALL:-}" ] && return 0
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "Not root, and there is no sudo: run as root  apt-get install ${missing[*]}" >&2; return 1; }
    if [ -z "${CI:-}" ]; then
      [ -t 0 ] || { echo "Not root and no terminal to ask: run  sudo apt-get install ${missing[*]}" >&2; return 1; }
      read -r -p "Use sudo to install them? [y/N] " answer
      [[ "$answer" =~ ^[yY] ]] || { echo "Nothing installed. By hand: sudo apt-get install ${missing[*]}" >&2; return 1; }
    fi
  fi
  local log
  log=$(mktemp)
  waymark_apt "$log" update || return 1
  waymark_apt "$log" install -y --no-install-recommends "${missing[@]}" || return 1
  rm -f "$log"
}

if [ "${BASH_SOURCE[0]}" = "$0" ]; then
  printf 'build: %s\n' "${WAYMARK_BUILD_PACKAGES[*]}"
  printf 'test:  %s\n' "${WAYMARK_TEST_PACKAGES[*]}"
fi
