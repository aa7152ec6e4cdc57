#!/usr/bin/python3
"""Runs every command in README.md and docs/, so that none of them becomes outdated.

Commands are the lines of blocks fenced as ```sh, ```bash or ```console (there: the lines that start with "$ "). A block
that must not be run is fenced as ```text. All blocks of one document run in order in one scratch folder, which initially contains
photograph.png, truth.csv and the folder photos/ (tests/cli/images.py). Commands may start with
  waymark …             run in the scratch folder
  ./… or tools/…        run in the repository; ./test.sh and ./demo.sh without arguments are skipped: continuous integration runs them
  mkdir ls cat head python3     run in the scratch folder
A block below "<!-- file: NAME -->" is written into the scratch folder under this name before the commands of the document run.
A document with "<!-- camera: NAME.png -->" has a camera /dev/video0 that plays the image (tests/fake_v4l2).
A command that must fail ends with "# exit N". `waymark view` and commands with --view serve until Ctrl-C, which is sent after
they have printed their address.

usage: tools/check_commands.py PROGRAM [FILE.md ...]     PROGRAM: the built waymark
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/cli"))
import images  # noqa: E402
from fake_camera import FakeCamera  # noqa: E402

FILE = re.compile(r"^<!-- file: ([\w.-]+) -->\n```\w+\n(.*?)^```[ \t]*$", re.M | re.S)
CAMERA = re.compile(r"^<!-- camera: photograph.png -->$", re.M)
FENCE = re.compile(r"^( *)```(sh|bash|console)[ \t]*\n(.*?)^\1```[ \t]*$", re.M | re.S)
RUN_BY_CI = {"./test.sh", "./demo.sh", "./test.sh --full", "./test.sh --quick"}
IN_REPOSITORY = ("./", "tools/")
IN_SCRATCH = ("waymark", "mkdir", "ls", "cat", "head", "python3")
SECONDS = 120


def commands(text):
    """(line number, command) for each command; lines that end with a backslash are joined."""
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


def text_of(output):
    return pathlib.Path(output.name).read_text(encoding="utf-8", errors="replace")


def wait_for_address(process, output):
    """Waits until a server prints its address and one second more, or until it ends."""
    for _ in range(10 * SECONDS):
        if process.poll() is not None:
            return
        if "http://" in text_of(output):
            time.sleep(1)
            return
        time.sleep(0.1)


def run(command, scratch, program, variables):
    """None if the command succeeded, else the error."""
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
        expected = 130  # exit code of a robot that is stopped by Ctrl-C
    path = f"{pathlib.Path(program).resolve().parent}:{os.environ['PATH']}"
    serves = bare.startswith("waymark view") or " --view" in bare
    with tempfile.NamedTemporaryFile() as output:
        process = subprocess.Popen(["bash", "-e", "-o", "pipefail", "-c", f"exec {bare}" if serves else bare], cwd=folder,
                                   env={**variables, "PATH": path}, stdin=subprocess.DEVNULL, stdout=output,
                                   stderr=subprocess.STDOUT)
        try:
            if serves:
                wait_for_address(process, output)
                process.send_signal(signal.SIGINT)
            process.wait(SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            return f"took more than {SECONDS} s"
        printed = text_of(output)
    if serves and "http://" not in printed:
        return f"printed no address\n{printed[-2000:]}"
    return None if process.returncode == expected else f"exit {process.returncode}, expected {expected}\n{printed[-4000:]}"


def camera_in(scratch, program):
    """The environment in which a camera plays the image of the scratch folder."""
    camera = FakeCamera(pathlib.Path(scratch) / ".camera", program)
    camera.play([images.scene(320, 240, images.SCENE_TAGS)])
    return camera.environment()


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
            images.fill(scratch)
            text = document.read_text(encoding="utf-8")
            for name, content in FILE.findall(text):
                (pathlib.Path(scratch) / name).write_text(content, encoding="utf-8")
            variables = camera_in(scratch, program) if CAMERA.search(text) else os.environ
            for number, command in commands(text):
                problem = run(command, scratch, program, variables)
                ran += 1
                if problem:
                    failed += 1
                    print(f"{document}:{number}: {command}\n    {problem}")
    print(f"{ran} commands in {len(documents)} documents, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
