#!/usr/bin/env bash
# Builds the page of `waymark view` (viewer/) into build/viewer/dist, from where CMake embeds it; runs its unit tests.
# Needs npm, and Node 20.19 or newer: the one of tools/install_validators.sh where the system's is older.
# Nothing is installed outside build/viewer; a second run is quick. usage: tools/build_viewer.sh
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p build/viewer
stamp=$(cat viewer/package-lock.json viewer/*.ts viewer/*.mjs viewer/*.json viewer/index.html $(find viewer/src -type f | sort) | cksum)
if [ -f build/viewer/stamp ] && [ "$(cat build/viewer/stamp)" = "$stamp" ]; then exit 0; fi

new_enough() { "$1" -e 'const [a, b] = process.versions.node.split(".").map(Number); process.exit(a > 22 || (a === 22 && b >= 12) || (a === 20 && b >= 19) ? 0 : 1)' 2>/dev/null; }
node=$(command -v node || true)
if [ -z "$node" ] || ! new_enough "$node"; then node="$PWD/build/npm/node_modules/.bin/node"; fi
new_enough "$node" || { echo "build_viewer.sh: no Node 20.19 or newer; tools/install_validators.sh installs one" >&2; exit 1; }

# A copy, so that the source folder stays clean.
mkdir -p build/viewer/source
rm -rf build/viewer/source/src build/viewer/dist
tar -C viewer --exclude=node_modules -cf - . | tar -C build/viewer/source -xf -
cd build/viewer/source
{ { cmp -s package-lock.json node_modules/of.lock || { npm ci --no-audit --no-fund --loglevel=error && cp package-lock.json node_modules/of.lock; }; } &&
  "$node" node_modules/typescript/bin/tsc --noEmit &&
  "$node" node_modules/vitest/vitest.mjs run && WAYMARK_VIEWER_OUT=../dist "$node" node_modules/vite/bin/vite.js build &&
  "$node" notices.mjs package-lock.json node_modules ../dist/notices.txt
} >../build.log 2>&1 || { tail -20 ../build.log >&2; exit 1; }
cd ..
gzip -9nf dist/*
echo "$stamp" >stamp
