#!/usr/bin/env bash
# Builds Waymark and tests it. See --help.
set -euo pipefail
cd "$(dirname "$0")"

usage() {
  cat <<'TXT'
usage: ./test.sh [--full] [--only PARTS] [--require-data] [--quick] [--tidy-base REV]

Installs what it needs (Debian packages, said by name), builds, and runs
  1. the build (preset check: warnings are errors; files of a room compiled together) and all unit, system and consumer tests
  2. the house rules: allowed edges, includes, formatting
  3. the tests of what reads foreign bytes under address and undefined behaviour sanitizers
  4. the fuzzers, ten seconds each
  5. clang-tidy, and GCC, on the files changed since the main branch (or in the last commit)

  --quick           only 1 and 2
  --full            also what takes hours: long Monte Carlo runs, all tests under the sanitizers, clang-tidy on everything,
                    all fuzzers for minutes, every header compiled alone, the thread sanitizer, coverage, benchmarks with
                    their ratios
  --only PARTS      only these, separated by commas: tests, house, sanitizers, fuzzers, tidy, headers, threads, coverage,
                    benchmarks; with --full in their long form (./test.sh --full --only tests,tidy)
  --require-data    a test that cannot find its real recordings fails instead of skipping. They are looked for in the
                    folder that WAYMARK_DATA names
  --tidy-base REV   what "changed" means for clang-tidy

Exit code 0 when everything passed. Build folders are build/<preset>; the second run is quick.
TXT
}

full=""; quick=""; only=""; tidy_base=""
while [ $# -gt 0 ]; do
  case "$1" in
    --full) full=1 ;;
    --quick) quick=1 ;;
    --only) only="${2:?--only needs the names of parts; see --help}"; shift ;;
    --require-data) export WAYMARK_REQUIRE_DATA=1 ;;
    --tidy-base) tidy_base="${2:?--tidy-base needs a revision}"; shift ;;
    -h|--help) usage; exit 0 ;;
    *) echo "test.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
  esac
  shift
done
[ -n "$full" ] && export WAYMARK_FULL=1
everything="tests,house,sanitizers,fuzzers,tidy,headers,threads,coverage,benchmarks"
if [ -n "$only" ]; then parts="$only"
elif [ -n "$full" ]; then parts="$everything"
elif [ -n "$quick" ]; then parts="tests,house"
else parts="tests,house,sanitizers,fuzzers,tidy"; fi
for part in ${parts//,/ }; do
  [[ ",$everything," == *",$part,"* ]] || { echo "test.sh: unknown part '$part'. There are $everything." >&2; exit 2; }
done
wanted() { [[ ",$parts," == *",$1,"* ]]; }
if [ -n "${WAYMARK_REQUIRE_DATA:-}" ] && [ ! -d "${WAYMARK_DATA:-}" ]; then
  echo "test.sh: --require-data, but WAYMARK_DATA ('${WAYMARK_DATA:-}') is not a folder" >&2
  exit 2
fi
if [ -n "${WAYMARK_DATA:-}" ]; then WAYMARK_DATA="$(realpath "$WAYMARK_DATA")"; export WAYMARK_DATA; fi

jobs=$(nproc)
export CCACHE_BASEDIR="$PWD" CCACHE_NOHASHDIR=1  # so that a second clone of the same code builds from the cache
started=$SECONDS
step() { printf '\n=== [%3d s] %s\n' "$((SECONDS - started))" "$*"; }
passed=0; failed=0; skipped=0

build() {  # build PRESET [targets...]
  local preset="$1"; shift
  cmake --preset "$preset" -DWAYMARK_UNITY=ON >"build/$preset.configure.log" 2>&1 || { cat "build/$preset.configure.log"; return 1; }
  cmake --build --preset "$preset" -j "$jobs" ${1:+--target "$@"} -- --quiet
}

run_tests() {  # run_tests PRESET [ctest options...]; adds to the totals
  local preset="$1"; shift
  local report="$PWD/build/$preset/tests.xml" outcome=0
  ctest --preset "$preset" -j "$jobs" --timeout "$([ -n "$full" ] && echo 7200 || echo 600)" --output-junit "$report" "$@" >"build/$preset/tests.log" 2>&1 || outcome=$?
  [ "$outcome" -eq 0 ] || sed -n '/^ *[0-9]*\/[0-9]* Test.*\*\*\*/,$p' "build/$preset/tests.log" | tail -150
  read -r total bad skip < <(sed -n 's/.*tests="\([0-9]*\)".*/\1/p;s/.*failures="\([0-9]*\)".*/\1/p;s/.*skipped="\([0-9]*\)".*/\1/p' \
    "$report" | head -3 | tr '\n' ' ') || true  # no newline at the end is no failure
  echo "$preset: $((total - bad - skip)) passed, $bad failed, $skip skipped"
  passed=$((passed + total - bad - skip)); failed=$((failed + bad)); skipped=$((skipped + skip))
  [ "$outcome" -eq 0 ]
}

helper=""
meanwhile() {  # meanwhile FUNCTION: in the background, where nobody else wants the processor; ends with this script
  set -m  # a process group of its own, to be ended as a whole
  (renice -n 19 "$BASHPID" >/dev/null; "$@") >build/meanwhile.log 2>&1 </dev/null &
  helper=$!
  set +m
}
trap '[ -z "$helper" ] || kill -- "-$helper" 2>/dev/null || true' EXIT

mkdir -p build
# shellcheck source=tools/packages.sh
source tools/packages.sh
waymark_install "${WAYMARK_BUILD_PACKAGES[@]}" "${WAYMARK_TEST_PACKAGES[@]}"
command -v npm >/dev/null || waymark_install npm  # Debian's, unless there is one already
tools/install_validators.sh || echo "test.sh: npm cannot install tests/npm: the test npm.recording skips"
tools/build_viewer.sh || echo "test.sh: the page of waymark view is not built: the test viewer.page skips"

# In their short form sanitizers and fuzzers share one build: what reads foreign bytes, and the fuzzers of pictures and YAML.
sanitized_rooms=(base codecs recording drivers/process)
short_fuzzers=(image_fuzz camera_yaml_fuzz yaml_fields_fuzz)
build_sanitized() {
  local targets=() room
  if wanted sanitizers; then for room in "${sanitized_rooms[@]}"; do targets+=("waymark_${room//\//_}_tests"); done; fi
  if wanted fuzzers; then targets+=("${short_fuzzers[@]}"); fi
  [ ${#targets[@]} -eq 0 ] || build fuzz "${targets[@]}"
}

if wanted tests; then
  step "build"
  build check
  step "unit, system and consumer tests"
  if [ -z "$full" ]; then meanwhile build_sanitized; fi  # half of a test's time is waiting
  run_tests check
  [ -z "$helper" ] || wait "$helper" || true  # what failed fails again below, with words
  helper=""
fi
unset WAYMARK_FULL  # what follows looks for other things than long runs do

if wanted house; then
  step "house rules: includes, formatting"
  tools/check_includes.py
  git ls-files '*.cpp' '*.hpp' | xargs clang-format-16 --dry-run --Werror
fi

if wanted sanitizers; then
  step "sanitizers: address, undefined behaviour"
  if [ -n "$full" ]; then
    build asan-ubsan
    run_tests asan-ubsan -LE slow_under_sanitizers
  else
    build_sanitized
    for room in "${sanitized_rooms[@]}"; do
      echo "sanitizers: $room"
      "build/fuzz/waymark/$room/waymark_${room//\//_}_tests" --gtest_brief=1 | tail -3
    done
  fi
fi

if wanted fuzzers; then
  step "fuzzers"
  if [ -n "$full" ]; then build fuzz; else build_sanitized; fi
  tools/run_fuzzers.sh build/fuzz "$([ -n "$full" ] && echo 120 || echo 10)"
fi

if wanted tidy; then
  step "clang-tidy"
  tools/tidy.sh ${full:+--all} ${tidy_base:+--base "$tidy_base"}
fi

if wanted headers; then
  step "every header compiled alone"
  cmake --preset dev -DCMAKE_VERIFY_INTERFACE_HEADER_SETS=ON >/dev/null
  cmake --build --preset dev -j "$jobs" --target all_verify_interface_header_sets -- --quiet
fi
if wanted threads; then
  step "thread sanitizer"
  mapfile -t programs < <(git grep -l 'TEST.*Threads' -- 'waymark/*_test.cpp' | sed 's|/[^/]*$|_tests|; s|/|_|g' | sort -u)
  build tsan "${programs[@]}"
  run_tests tsan -L threads
fi
if wanted coverage; then
  step "coverage"
  build coverage
  run_tests coverage
  gcovr --root . --filter 'waymark/' --exclude '.*_test\.cpp' build/coverage --print-summary | tail -25
fi
if wanted benchmarks; then
  step "benchmarks"
  build release
  tools/benchmark_ratios.py build/release/benchmarks
fi

step "done in $((SECONDS - started)) s"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
