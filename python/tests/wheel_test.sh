#!/usr/bin/env bash
# The package as `cmake --install` puts it, and as a wheel in a virtual environment without a network, which brings the worlds.
# usage: wheel_test.sh SOURCE BUILD PYTHON    The wheel takes long: only with WAYMARK_FULL.
set -euo pipefail
source_folder=$1 build=$2 python=$3
unset PYTHONPATH WAYMARK_SHARE
[ -z "${WAYMARK_FULL:-}" ] || "$python" -c 'import ensurepip, setuptools, wheel' 2>/dev/null || { echo "venv, setuptools or wheel is missing (Debian: python3-venv python3-setuptools python3-wheel)" >&2; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
try='import sys, waymark, numpy; from waymark import config, tags; from waymark.labs import lab12, loops
assert waymark.__file__.startswith(sys.argv[1]), waymark.__file__
assert len(config.read_world("circuit24").tags) == 24
assert tags.Detector().detect(numpy.zeros((99, 99), numpy.uint8)) == []'
cd "$folder"

cmake --install "$build" --component python --prefix "$folder/usr" >/dev/null
installed=$(dirname "$(find "$folder/usr" -path '*waymark/__init__.py')")
PYTHONPATH=$(dirname "$installed") "$python" -c "$try" "$folder/usr"

[ -n "${WAYMARK_FULL:-}" ] || exit 0
"$python" "$source_folder/tools/build_wheel.py" "$build" "$folder/wheels"
"$python" -m venv --system-site-packages "$folder/venv"  # for NumPy
"$folder/venv/bin/pip" install -q --no-index --no-deps "$folder"/wheels/waymark-*.whl
"$folder/venv/bin/python" -c "$try" "$folder/venv"
"$folder/venv/bin/python" -c 'import os, waymark; assert os.environ["WAYMARK_SHARE"].endswith("waymark/share")'
