#!/usr/bin/env bash
# Builds the pages of web/, which detect tags and solve poses in the browser, into build/web/pages, with Debian's emscripten (WebAssembly).
# Exit code 77 where emscripten is missing. A second run is quick. usage: tools/build_web.sh
set -euo pipefail
cd "$(dirname "$0")/.."
command -v emcmake >/dev/null || { echo "build_web.sh: no emscripten (Debian: emscripten), so the pages are left out" >&2; exit 77; }
# Debian's emscripten reads JavaScript with Debian's acorn, which a Node from elsewhere does not find by itself.
export NODE_PATH="${NODE_PATH:+$NODE_PATH:}/usr/share/nodejs"
mkdir -p build/web
jobs=$(nproc)
{
  cmake -S web -B build/web/host -G Ninja -DCMAKE_BUILD_TYPE=None
  cmake --build build/web/host -j "$jobs" -- --quiet
  build/web/host/write_family_tables >build/web/family_tables.new
  # Only a changed table is compiled again.
  cmp -s build/web/family_tables.new build/web/family_tables.hpp || mv build/web/family_tables.new build/web/family_tables.hpp
  emcmake cmake -S web -B build/web/wasm -G Ninja -DCMAKE_BUILD_TYPE=None -DWAYMARK_FAMILY_TABLES="$PWD/build/web"
  cmake --build build/web/wasm -j "$jobs" -- --quiet
} >build/web/build.log 2>&1 || { tail -30 build/web/build.log >&2; exit 1; }
rm -rf build/web/pages
mkdir build/web/pages
cp web/page/* build/web/wasm/waymark.js build/web/pages/
# What waymark.js holds parts of: libraries of headers, the families' codes, and emscripten's own runtime with its C and C++ libraries.
for package in libeigen3-dev libfmt-dev libexpected-dev libapriltag-dev emscripten; do
  printf '==== %s\n\n' "$package"
  cat "/usr/share/doc/$package/copyright"
done >build/web/pages/notices.txt
