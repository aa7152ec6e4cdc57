#!/usr/bin/env bash
# Runs every fuzzer of a build for some seconds on its corpus.  usage: tools/run_fuzzers.sh BUILD_FOLDER SECONDS
set -euo pipefail
build="$1"; seconds="$2"
found=0
for fuzzer in "$build"/fuzz/*_fuzz; do
  [ -x "$fuzzer" ] || continue
  found=1
  name=$(basename "$fuzzer" _fuzz)
  work=$(mktemp -d)
  seeds="$(dirname "$0")/../fuzz/corpus/$name"
  mkdir -p "$work/corpus"
  echo "$name: $seconds s"
  if ! "$fuzzer" -max_total_time="$seconds" -seed=1 -timeout=20 -rss_limit_mb=4096 -artifact_prefix="$work/" \
      "$work/corpus" $([ -d "$seeds" ] && echo "$seeds") >"$work/log" 2>&1; then
    tail -40 "$work/log"
    echo "$name found an input that breaks it; it is in $work" >&2
    exit 1
  fi
  grep -E 'DONE|stat::number_of_executed_units' "$work/log" | tail -1
  rm -rf "$work"
done
[ "$found" -eq 1 ] || { echo "no fuzzers in $build/fuzz" >&2; exit 1; }
