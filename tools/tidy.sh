#!/usr/bin/env bash
# clang-tidy on what changed.  usage: tools/tidy.sh [--all] [--base REV]
set -euo pipefail
cd "$(dirname "$0")/.."
base=""; all=""
while [ $# -gt 0 ]; do
  case "$1" in
    --all) all=1 ;;
    --base) base="$2"; shift ;;
    *) echo "usage: tools/tidy.sh [--all] [--base REV]" >&2; exit 2 ;;
  esac
  shift
done
if [ -z "$base" ]; then
  base=$(git merge-base HEAD origin/main 2>/dev/null || true)
  # On the main branch itself: the last commit.
  if [ -z "$base" ] || [ "$base" = "$(git rev-parse HEAD)" ]; then
    base=$(git rev-list --max-count=2 HEAD | tail -1)
  fi
fi
if [ -n "$all" ]; then
  mapfile -t files < <(git ls-files 'waymark/*.cpp' 'tests/*.cpp' 'examples/*.cpp')
else
  mapfile -t changed < <( { git diff --name-only --diff-filter=d "$base"; git ls-files --others --exclude-standard; } | sort -u)
  files=()
  for file in "${changed[@]}"; do
    # Tests are for --all: instantiating their frameworks takes half a minute each.
    [[ "$file" =~ ^(waymark|examples)/.*\.cpp$ && ! "$file" =~ _test\.cpp$ ]] && files+=("$file")
    # A changed header is seen through the source beside it.
    [[ "$file" =~ ^waymark/.*\.hpp$ ]] && [ -f "${file%.hpp}.cpp" ] && files+=("${file%.hpp}.cpp")
  done
  mapfile -t files < <(printf '%s\n' "${files[@]}" | sort -u | sed '/^$/d')
fi
# Only what the dev build compiles has flags to check it with; configuring it is enough.
cmake --preset dev >/dev/null
mapfile -t files < <(for f in "${files[@]}"; do grep -q "\"file\": \".*/$f\"" build/dev/compile_commands.json && echo "$f"; done)
echo "clang-tidy on ${#files[@]} files"
[ ${#files[@]} -eq 0 ] && exit 0
# GCC's own warning names are unknown to clang; that is not the code's fault.
# The analyzer is slow on templates: with --all only.
checks=$([ -n "$all" ] && echo "clang-analyzer-*,-clang-analyzer-security.FloatLoopCounter" || echo "")
printf '%s\n' "${files[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy-16 -p build/dev --quiet --checks="$checks" --extra-arg=-Wno-unknown-warning-option 2>/dev/null
# What clang compiles GCC may not (the preset check is clang's, with headers precompiled): the same files by the dev preset's compiler.
if [ -z "$all" ]; then
  python3 - "${files[@]}" <<'PY'
import concurrent.futures, json, os, pathlib, subprocess, sys
wanted = {str(pathlib.Path(name).resolve()) for name in sys.argv[1:]}
units = [unit for unit in json.loads(pathlib.Path("build/dev/compile_commands.json").read_text()) if unit["file"] in wanted]
def compile(unit):
    return subprocess.run(unit["command"] + " -fsyntax-only", shell=True, check=False, cwd=unit["directory"]).returncode
with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    sys.exit(max(pool.map(compile, units), default=0))
PY
fi
