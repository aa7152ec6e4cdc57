#!/usr/bin/env bash
# Builds the Debian packages, a tarball for other distributions, the bill of materials and the checksums.
# usage: tools/make_packages.sh [OUT_FOLDER]       (default: build/package/packages)
# The date of everything is that of the last commit (SOURCE_DATE_EPOCH), so that two builds give the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in -h|--help) sed -n '2,4s/^# //p' "$0"; exit 0 ;; esac
# shellcheck source=tools/packages.sh
source tools/packages.sh
waymark_install "${WAYMARK_BUILD_PACKAGES[@]}" python3 pybind11-dev python3-dev python3-numpy file dpkg-dev patchelf
if command -v npm >/dev/null; then tools/build_viewer.sh; fi
[ -f build/viewer/dist/notices.txt.gz ] || { echo "make_packages.sh: the page of waymark view is not built (npm is missing); a package holds it" >&2; exit 1; }

SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export SOURCE_DATE_EPOCH TZ=UTC LC_ALL=C.UTF-8
mkdir -p build
cmake --preset package >build/package.configure.log 2>&1 || { cat build/package.configure.log; exit 1; }
cmake --build --preset package -j "$(nproc)" -- --quiet
rm -rf build/package/packages
(cd build/package && cpack -G DEB >cpack.log 2>&1) || { cat build/package/cpack.log; exit 1; }
rm -rf build/package/packages/_CPack_Packages  # where it puts packages together
tools/make_tarball.py build/package build/package/packages
tools/make_sbom.py build/package/bin/waymark build/package/bin/waymark-watchdog >build/package/packages/waymark.spdx.json
(cd build/package/packages && sha256sum -- * >SHA256SUMS)
out=${1:-build/package/packages}
if [ "$out" != build/package/packages ]; then mkdir -p "$out"; cp -a build/package/packages/. "$out"; fi
ls -l "$out"
