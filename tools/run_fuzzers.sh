#!/usr/bin/env bash
# Runs every fuzzer of a build for some seconds on its corpus, one more at once than there are processors: each is given time, not work.
# usage: tools/run_fuzzers.sh BUILD_FOLDER SECONDS
set -euo pipefail
build="$1"; seconds="$2"
corpora="$(cd "$(dirname "$0")/.." && pwd)/fuzz/corpus"

fuzz() {  # fuzz PROGRAM SECONDS CORPORA
  local name work seeds=()
  name=$(basename "$1" _fuzz)
  work=$(mktemp -d)
  mkdir -p "$work/corpus"
  if [ -d "$3/$name" ]; then seeds=("$3/$name"); fi
  if ! "$1" -max_total_time="$2" -seed=1 -timeout=20 -rss_limit_mb=4096 -artifact_prefix="$work/" \
      "$work/corpus" "${seeds[@]}" >"$work/log" 2>&1; then
    tail -40 "$work/log"
    echo "$name found an input that breaks it; it is in $work" >&2
    return 1
  fi
  echo "$name: $2 s: $(grep -E 'DONE|stat::number_of_executed_units' "$work/log" | tail -1)"
  rm -rf "$work"
}
export -f fuzz

mapfile -t programs < <(find "$build/fuzz" -maxdepth 1 -name '*_fuzz' -type f -executable | sort)
[ ${#programs[@]} -gt 0 ] || { echo "no fuzzers in $build/fuzz" >&2; exit 1; }
printf '%s\n' "${programs[@]}" | xargs -P "$(($(nproc) + 1))" -I PROGRAM bash -euo pipefail -c 'fuzz "$@"' fuzz PROGRAM "$seconds" "$corpora"
