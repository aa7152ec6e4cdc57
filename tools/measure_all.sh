#!/usr/bin/env bash
# Measures the tables of docs/ again. See --help.
set -euo pipefail
cd "$(dirname "$0")/.."

usage() {
  cat <<'TXT'
usage: tools/measure_all.sh PROGRAM DATA [--only PARTS]

Measures the tables of docs/results-second-judge.md and docs/results/ with a built program and writes them in place.

  PROGRAM  the built waymark of a release (build/release/bin/waymark)
  DATA     folder of real recordings, as WAYMARK_DATA
  PARTS    separated by commas; all of them unless given:
             laps, faults, logs         by the second judge (tests/plant)
             tagslam                    TagSLAM's recordings
             localization               recordings of others and simulation
             replay                     simulation
             page                       the page in the browser; prints its figures, the table is kept by hand

Hours on two cores. Nothing else should run meanwhile: times are of the processor, the page's are not.
TXT
}

known="laps,faults,logs,tagslam,localization,replay,page"; parts="$known"; given=()
while [ $# -gt 0 ]; do
  case "$1" in
    --only) parts="${2:?--only needs the names of parts; see --help}"; shift ;;
    -h|--help) usage; exit 0 ;;
    -*) echo "measure_all.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
    *) given+=("$1") ;;
  esac
  shift
done
[ ${#given[@]} -eq 2 ] || { usage >&2; exit 2; }
program="$(realpath "${given[0]}")"; data="$(realpath "${given[1]}")"
[ -x "$program" ] || { echo "measure_all.sh: '$program' is not a program" >&2; exit 2; }
for part in ${parts//,/ }; do
  [[ ",$known," == *",$part,"* ]] || { echo "measure_all.sh: unknown part '$part'. There are $known." >&2; exit 2; }
done

second=docs/results-second-judge.md
for part in ${parts//,/ }; do
  printf '\n=== %s\n' "$part"
  case "$part" in
    laps) tests/plant/table.py "$program" --camera corners --write "$second" ;;
    faults) tests/plant/faults.py "$program" --scripts 13 --each --seed 1 --write "$second" ;;
    logs) tests/plant/log_table.py "$program" --seeds 8 --write "$second" ;;
    tagslam) tools/tagslam_table.py "$program" "$data" --write docs/results/mapping.md ;;
    localization) tools/localization_table.py "$program" "$data" --write docs/results/localization.md ;;
    replay) tools/replay_table.py "$program" --data "$data" --images-seeds 5 --images-laps 10 --images-fast-seeds 5 --write docs/results/replay.md ;;
    page) tools/measure_page.py "$program" "$(dirname "$program")/../benchmarks" ;;
  esac
done
