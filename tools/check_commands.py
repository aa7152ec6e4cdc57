#!/usr/bin/python3
"""Runs every command that README.md and docs/ show, so that none of them goes stale.

Commands are the lines of blocks fenced as ```sh, ```bash or ```console (there: the lines that start with "$ "). A block
that is not to be run is fenced as ```text. All blocks of one document run in order in one scratch folder, which starts with
photograph.png, truth.csv and the folder photos/ (tests/cli/pictures.py). Commands may start with
  waymark …             run in the scratch folder
  ./… or tools/…        run in the repository; ./test.sh and ./demo.sh alone are known: continuous integration runs them itself
  mkdir ls cat head     run in the scratch folder
A command that is meant to fail ends with "# exit N". `waymark view` and what has --view serve until Ctrl-C: they get one after five seconds.

usage: tools/check_commands.py PROGRAM [FILE.md ...]     PROGRAM: the built waymark
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/cli"))
import pictures  # noqa: E402

FENCE = re.compile(r"^( *)```(sh|bash|console)[ \t]*\n(.*?)^\1```[ \t]*$", re.M | re.S)
RUN_BY_CI = {"./test.sh", "./demo.sh", "./test.sh --full", "./test.sh --quick"}
IN_REPOSITORY = ("./", "tools/")
IN_SCRATCH = ("waymark", "mkdir", "ls", "cat", "head")
SECONDS = 120


def commands(text):
    """(line number, command) for each command; lines joined where they end with a backslash."""
    for block in FENCE.finditer(text):
        number = text.count("\n", 0, block.start()) + 1
        pending, start = "", 0
        for line in block.group(3).splitlines():
            number += 1
            line = line.strip()
            if block.group(2) == "console" and not pending:
                if not line.startswith("$ "):
                    continue
                line = line[2:]
            if not pending:
                start = number
            pending += line
            if pending.endswith("\\"):
                pending = pending[:-1] + " "
                continue
            if pending and not pending.startswith("#"):
                yield start, pending
            pending = ""


def run(command, scratch, program):
    """Nothing when the command did what it should, else what went wrong."""
    expected = re.search(r"# exit (\d+)$", command)
    expected = int(expected.group(1)) if expected else 0
    bare = re.sub(r"\s+#.*$", "", command)
    if bare in RUN_BY_CI:
        return None
    if bare.startswith(IN_REPOSITORY):
        folder = ROOT
    elif bare.split()[0] in IN_SCRATCH:
        folder = scratch
    else:
        return "is not of a kind this check can run; fence the block as ```text"
    if " --view" in bare:
        expected = 130  # that is how a robot ends that is stopped by Ctrl-C
    if bare.startswith("waymark view") or " --view" in bare:
        bare = "timeout --foreground --preserve-status -s INT 5 " + bare  # once: not also to its group
    path = f"{pathlib.Path(program).resolve().parent}:{os.environ['PATH']}"
    try:
        done = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", bare], cwd=folder, env={**os.environ, "PATH": path},
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", timeout=SECONDS,
                              check=False)
    except subprocess.TimeoutExpired:
        return f"took more than {SECONDS} s"
    if done.returncode == expected:
        return None
    return f"exit {done.returncode}, expected {expected}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    program = sys.argv[1]
    documents = [pathlib.Path(name) for name in sys.argv[2:]]
    if not documents:
        documents = sorted({*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")})
    ran, failed = 0, 0
    for document in documents:
        with tempfile.TemporaryDirectory(prefix="waymark-docs-") as scratch:
            pictures.fill(scratch)
            for number, command in commands(document.read_text(encoding="utf-8")):
                problem = run(command, scratch, program)
                ran += 1
                if problem:
                    failed += 1
                    print(f"{document}:{number}: {command}\n    {problem}")
    print(f"{ran} commands in {len(documents)} documents, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
