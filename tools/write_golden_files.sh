#!/usr/bin/env bash
# Writes tests/golden/VERSION: a lap, its map, the JSON of each verb, and the public functions, of that version's build (tests/golden/README.md).
# usage: tools/write_golden_files.sh VERSION PROGRAM BUILD_FOLDER
set -euo pipefail
version="${1:?usage: tools/write_golden_files.sh VERSION PROGRAM BUILD_FOLDER}"
program="$(realpath "${2:?usage: tools/write_golden_files.sh VERSION PROGRAM BUILD_FOLDER}")"
build="$(realpath "${3:?usage: tools/write_golden_files.sh VERSION PROGRAM BUILD_FOLDER}")"
folder="$(cd "$(dirname "$0")/.." && pwd)/tests/golden/$version"
[ ! -e "$folder" ] || { echo "$folder is there already; golden files never change" >&2; exit 1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir -p "$folder/map" "$folder/json"
cd "$scratch"
"$program" teach --world mbot-square --seed 1 -o lap.mcap 2>/dev/null
"$program" info lap.mcap --json >"$folder/json/info.json"
"$program" map lap.mcap -o map --json >"$folder/json/map.json" 2>/dev/null
"$program" localize lap.mcap --map map/map.yaml -o estimate.mcap --json >"$folder/json/localize.json" 2>/dev/null
"$program" evaluate estimate.mcap lap.mcap --json >"$folder/json/evaluate.json"
"$program" replay map --robot sim --world mbot-square --seed 5 -o drive.mcap --json >"$folder/json/replay.json" 2>/dev/null
"$folder/../../../tools/list_symbols.py" "$build" >"$folder/symbols.txt"
cp lap.mcap "$folder/"
cp map/map.yaml map/route.yaml map/robot.yaml "$folder/map/"
