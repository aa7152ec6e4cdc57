#!/usr/bin/env bash
# Builds Waymark and tests it. See --help.
set -euo pipefail
cd "$(dirname "$0")"

usage() {
  cat <<'TXT'
usage: ./test.sh [--quick | --only PARTS | --full[=PARTS] [--again]] [--require-data] [--tidy-base REV]

Installs what it needs (Debian packages; prints their names), builds, and runs
  1. the house rules: allowed edges, includes, words, formatting
  2. the build (preset check: warnings are errors; files of a room compiled together) and all unit, system and consumer tests
  3. the tests of what reads foreign bytes under address and undefined behaviour sanitizers
  4. the fuzzers, ten seconds each
  5. clang-tidy, and GCC, on the files changed since the main branch (or in the last commit)

  --quick           only 1 and 2
  --only PARTS      only these of the short run, separated by commas: tests, house, sanitizers, fuzzers, tidy
  --full[=PARTS]    what takes long, in parts of 40 minutes at most on two cores; all of them, or those named, separated by commas:
                      tests          the short run's build and tests, and the house rules
                      pose           Monte Carlo runs of detection, refinement, pose and camera calibration
                      map            Monte Carlo runs of mapping and calibration; all of TagSLAM's recordings
                      map-properties-1, map-properties-2
                                     recordings with random injected causes: no map is silently wrong (250 and 50 clean ones each); their table
                                     is kept in build/check/map_properties/
                      localize       Monte Carlo runs of localisation
                      replay         Monte Carlo runs of replay, an hour of exploring, robots that are processes
                      python         the wheel in a virtual environment, mypy, the labs as notebooks, the exercise of the Academy at length
                      site           the site with its pages that work in the browser (WebAssembly by emscripten), used in Chromium
                      sanitizers     all tests under the address and undefined behaviour sanitizers, those of the Python package too
                      threads        the thread sanitizer
                      fuzz           all fuzzers, two minutes each
                      tidy           clang-tidy with its analyzer on every file
                      headers        every header compiled alone
                      coverage       line coverage
                      benchmarks     speed as ratios to peers in the same run
                      devices        cameras by Linux' own driver vivid, and gamepads by its uinput, on a Debian kernel under QEMU
                      packages       Debian packages and tarball: built twice with the same bytes, lintian, installed, upgraded and removed in
                                     a clean Debian (needs root)
                      arm            core rooms built for 64-bit ARM, their unit tests under qemu-user (needs root)
                      arm-packages   Debian packages for 64-bit ARM: cross-built, installed in a clean Debian, the demo under qemu-user, removed (needs
                                     root)
                      readme         README's two commands, twice, in a folder with spaces, as root (needs root)
                      readme-user    the same as a new user without sudo (needs root)
                      ci             the commands of .github/workflows/ci.yml in a clean Debian (needs root)
                    A part that passed for the same sources is not run again: the result is kept in build/full/<tree>/
  --again           with --full: run also the parts that passed before
  --require-data    a test that cannot find its real recordings fails instead of skipping. They are looked for in the
                    folder that WAYMARK_DATA names
  --tidy-base REV   what "changed" means for clang-tidy

Exit code 0 when everything passed. Build folders are build/<preset>; the second run is quick.
TXT
}

short_parts="tests,house,sanitizers,fuzzers,tidy"
full_parts="tests,pose,map,map-properties-1,map-properties-2,localize,replay,python,site,sanitizers,threads,fuzz,tidy,headers,coverage,benchmarks,devices,packages,arm,arm-packages,readme,readme-user,ci"
full=""; parts="$short_parts"; known="$short_parts"; again=""; tidy_base=""
while [ $# -gt 0 ]; do
  case "$1" in
    --full) full=1; parts="$full_parts"; known="$full_parts" ;;
    --full=*) full=1; parts="${1#--full=}"; known="$full_parts" ;;
    --again) again=1 ;;
    --quick) parts="tests,house" ;;
    --only) parts="${2:?--only needs the names of parts; see --help}"; shift ;;
    --require-data) export WAYMARK_REQUIRE_DATA=1 ;;
    --tidy-base) tidy_base="${2:?--tidy-base needs a revision}"; shift ;;
    -h|--help) usage; exit 0 ;;
    *) echo "test.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
  esac
  shift
done
for part in ${parts//,/ }; do
  [[ ",$known," == *",$part,"* ]] || { echo "test.sh: unknown part '$part'. There are $known." >&2; exit 2; }
done
wanted() { [[ ",$parts," == *",$1,"* ]]; }
if [ -n "${WAYMARK_REQUIRE_DATA:-}" ] && [ ! -d "${WAYMARK_DATA:-}" ]; then
  echo "test.sh: --require-data, but WAYMARK_DATA ('${WAYMARK_DATA:-}') is not a folder" >&2
  exit 2
fi
if [ -n "${WAYMARK_DATA:-}" ]; then WAYMARK_DATA="$(realpath "$WAYMARK_DATA")"; export WAYMARK_DATA; fi

jobs=$(nproc)
export CCACHE_BASEDIR="$PWD" CCACHE_NOHASHDIR=1  # so that a second clone builds from the cache what has no precompiled header (its absolute path counts)
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime  # what precompiled headers ask for
started=$SECONDS
step() { printf '\n=== [%3d s] %s\n' "$((SECONDS - started))" "$*"; }
passed=0; failed=0; skipped=0

build() {  # build PRESET [targets...]
  local preset="$1"; shift
  cmake --preset "$preset" -DWAYMARK_UNITY=ON >"build/$preset.configure.log" 2>&1 || { cat "build/$preset.configure.log"; return 1; }
  cmake --build --preset "$preset" -j "$jobs" ${1:+--target "$@"} -- --quiet
}

run_tests() {  # run_tests PRESET [ctest options...]; adds to the totals. A selection without tests fails. at_once: processes at a time
  local preset="$1" outcome=0 ok bad skip; shift
  local report="$PWD/build/$preset/tests.xml" log="$PWD/build/$preset/tests.log"
  ctest --preset "$preset" --no-tests=error -j "${at_once:-$((2 * jobs))}" --timeout "$([ -n "$full" ] && echo 7200 || echo 900)" \
    --test-output-size-passed 65536 --test-output-truncation head --output-junit "$report" "$@" >"$log" 2>&1 || outcome=$?
  [ "$outcome" -eq 0 ] || { sed -n '/^ *[0-9]*\/[0-9]* Test.*\*\*\*/,$p' "$log" | tail -150; grep 'No tests were found' "$log" || true; }
  read -r ok bad skip < <(tools/count_tests.py "$report")
  echo "$preset: $ok passed, $bad failed, $skip skipped"
  passed=$((passed + ok)); failed=$((failed + bad)); skipped=$((skipped + skip))
  [ "$outcome" -eq 0 ]
}

mkdir -p build
# shellcheck source=tools/packages.sh
source tools/packages.sh
waymark_install "${WAYMARK_BUILD_PACKAGES[@]}" "${WAYMARK_TEST_PACKAGES[@]}"
# libc++ 14 lacks what the C++ library of Debian's emscripten lacks: the test web.sources reads the sources of web/ with its headers, in seconds and
# without emscripten. Installed, it would remove libunwind-dev, without which there is no GStreamer.
waymark_unpack build/libcxx libc++-14-dev || echo "test.sh: the headers of libc++ 14 cannot be fetched: the test web.sources fails"
command -v npm >/dev/null || waymark_install npm  # Debian's, unless there is one already
tools/install_validators.sh || echo "test.sh: npm cannot install tests/npm: the tests npm.* skip"
tools/build_viewer.sh || echo "test.sh: the page of waymark view is not built: the test viewer.page skips"

threaded_tests=(waymark_{core,tags,simulation,robots,app}_tests)  # the programs with tests whose names contain "Threads"
# In their short form sanitizers and fuzzers share one build: what reads foreign bytes, and the fuzzers of images and YAML.
sanitized_tests=waymark_bytes_tests
short_fuzzers=(image_fuzz camera_yaml_fuzz yaml_fields_fuzz)
build_sanitized() {
  local targets=()
  if wanted sanitizers; then targets+=("$sanitized_tests"); fi
  if wanted fuzzers; then targets+=("${short_fuzzers[@]}"); fi
  [ ${#targets[@]} -eq 0 ] || build fuzz "${targets[@]}"
}

run_short_tests() {  # steps are joined by &&: bash does not stop at errors in what a condition asks
  build check && run_tests check
}

house_rules() {
  step "house rules: includes, words, formatting"
  tools/check_includes.py && tools/check_words.py && git ls-files '*.cpp' '*.hpp' | xargs clang-format-16 --dry-run --Werror
}

long_tests() {  # long_tests REGEX: the tests with a label that matches (a room, a file of tests/, or full_…), with as many runs as WAYMARK_FULL asks for
  build check && WAYMARK_FULL=1 run_tests check -L "$1"
}

full_part() {  # full_part NAME: one part of --full
  step "full: $1"
  case "$1" in
    tests) run_short_tests && house_rules ;;
    pose) long_tests '^(tags|pose|mapping/.*|refinement_.*|rendered_pose|scene_camera_detection|calibrate_photograph|waymark_detector_sets|detector_real_data|sheets)$' ;;
    map) long_tests '^(map_.*|lap_calibration|recording|app/.*|full_map)$' ;;
    map-properties-1) WAYMARK_FIRST_SEED=1 long_tests '^full_map_properties$' ;;
    map-properties-2) WAYMARK_FIRST_SEED=126 long_tests '^full_map_properties$' ;;
    localize) long_tests '^(localization.*|full_localize)$' ;;
    replay) long_tests '^(replay.*|reversing_route|loop|pipeline|runtime|full_replay)$' ;;
    python) long_tests '^full_python$' ;;
    site) waymark_install "${WAYMARK_WEB_PACKAGES[@]}" && tools/build_web.sh && long_tests '^full_site$' ;;
    sanitizers)
      build asan-ubsan && run_tests asan-ubsan -LE slow_under_sanitizers || return 1
      step "full: sanitizers, Python: bad input, buffers, lifetime, threads, fork, pickles"
      build asan-python waymark_python && run_tests asan-python -L python_sanitized ;;
    threads)
      build tsan "${threaded_tests[@]}" && run_tests tsan -L '^threads$' &&
        [ "$(ctest --preset tsan -N -L '^threads$' | grep -c ' Test ')" -eq "$(git grep -lE '^TEST.*Threads' -- 'waymark/*_test.cpp' | wc -l)" ] ;;
    fuzz) build fuzz && tools/run_fuzzers.sh build/fuzz 120 ;;
    tidy) tools/tidy.sh --all ;;
    headers)
      cmake --preset dev -DCMAKE_VERIFY_INTERFACE_HEADER_SETS=ON >/dev/null &&
        cmake --build --preset dev -j "$jobs" --target all_verify_interface_header_sets -- --quiet ;;
    coverage)
      build coverage && run_tests coverage &&
        gcovr --root . --filter 'waymark/' --exclude '.*_test\.cpp' build/coverage --print-summary | tail -25 ;;
    benchmarks) build release && tools/benchmark_ratios.py build/release/benchmarks ;;
    devices) full_devices ;;
    packages) full_packages ;;
    arm) tests/arm/test.sh ;;
    arm-packages) tests/arm/packages.sh ;;
    readme) tests/readme/test.sh root ;;
    readme-user) tests/readme/test.sh user ;;
    ci) tests/ci/test.sh ;;
  esac
}

full_devices() {
  waymark_install "${WAYMARK_DEVICE_PACKAGES[@]}" && build check waymark &&
    /usr/bin/python3 tests/devices/devices_test.py build/check/bin/waymark build/devices
}

full_packages() {  # a second build in another folder must give the same bytes
  local second
  second=$(mktemp -d)
  tools/make_packages.sh && tests/packages/test.sh build/package/packages && git clone -q . "$second/waymark" &&
    mkdir "$second/waymark/build" && cp -a build/viewer build/npm "$second/waymark/build/" &&
    (cd "$second/waymark" && CCACHE_DISABLE=1 tools/make_packages.sh >/dev/null) &&
    diff build/package/packages/SHA256SUMS "$second/waymark/build/package/packages/SHA256SUMS"
  local outcome=$?
  rm -rf "$second"
  return $outcome
}

tree_hash() {  # of the sources as they lie here, committed or not
  local index
  index=$(mktemp -u)
  GIT_INDEX_FILE="$index" git read-tree HEAD
  GIT_INDEX_FILE="$index" git add -A
  GIT_INDEX_FILE="$index" git write-tree
  rm -f "$index"
}

run_full() {  # every part that is asked for, and did not pass for these sources already; all of them, whatever fails
  local kept outcome part began
  kept="build/full/$(tree_hash)"
  mkdir -p "$kept"
  outcome=0
  for part in ${parts//,/ }; do
    if [ -z "$again" ] && [ -f "$kept/$part" ]; then echo "full: $part passed for these sources before: $(cat "$kept/$part")"; continue; fi
    began=$SECONDS
    if (full_part "$part") 2>&1 | tee "$kept/$part.log"; then
      echo "$((SECONDS - began)) s, $(date -u +%Y-%m-%dT%H:%MZ)" >"$kept/$part"
    else
      echo "full: $part failed; the output is in $kept/$part.log" >&2
      outcome=1
    fi
  done
  for part in ${parts//,/ }; do printf '%-16s %s\n' "$part" "$(cat "$kept/$part" 2>/dev/null || echo failed)"; done
  return $outcome
}

if [ -n "$full" ]; then
  run_full
  exit
fi

if wanted house; then house_rules; fi  # first: they take seconds

incomplete=""
if wanted tests; then
  step "build"
  build check
  step "tests in real time"  # nothing runs beside them: beside a build at the lowest priority some kernels stop them for seconds
  at_once=$((jobs + 1)) run_tests check -L '^real_time$' || incomplete=1
  step "all other tests"
  run_tests check -LE '^real_time$' || incomplete=1
fi

if wanted sanitizers; then
  step "sanitizers: address, undefined behaviour"
  build_sanitized
  "build/fuzz/tests/$sanitized_tests" --gtest_brief=1 | tail -3
fi
if wanted fuzzers; then
  step "fuzzers"
  build_sanitized
  tools/run_fuzzers.sh build/fuzz 10
fi
if wanted tidy; then
  step "clang-tidy"
  tools/tidy.sh ${tidy_base:+--base "$tidy_base"}
fi

step "done in $((SECONDS - started)) s"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ] && [ -z "$incomplete" ]
