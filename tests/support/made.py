"""Folders written by command lines of the program, once for all tests of a build: the same arguments and seed give the same bytes (map_test.py)."""
import atexit
import fcntl
import functools
import hashlib
import os
import pathlib
import shutil
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAP, OTHER_LAP = (("teach --world circuit24 --seed %d -o lap.mcap" % seed,) for seed in (2, 3))
MAP = (*LAP, "map lap.mcap -o map")
DEMO = ("demo -o demo",)
LAP_OF_SQUARE = ("teach --world mbot-square --seed 1 -o lap.mcap",)
MAP_OF_SQUARE = (*LAP_OF_SQUARE, "map lap.mcap -o map")


def state_of(program):
    """A hash that depends on the program and on the worlds and robots that it reads."""
    files = [pathlib.Path(program), *sorted(path for path in (ROOT / "share").rglob("*") if path.is_file())]
    lines = [f"{path} {path.stat().st_size} {path.stat().st_mtime_ns}" for path in files]
    return hashlib.sha256("\n".join([os.environ.get("WAYMARK_SHARE", ""), *lines]).encode()).hexdigest()[:16]


@functools.cache
def shelf(program):
    """The parent of the folders of this program: in its build folder, or temporary for an installed program."""
    build = next((folder for folder in pathlib.Path(program).parents if (folder / "CMakeCache.txt").exists()), None)
    if build is None or not os.access(build, os.W_OK):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-made-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        return folder
    kept = build / "made" / state_of(program)
    for other in kept.parent.glob("*"):  # of an earlier build
        if other != kept:
            shutil.rmtree(other, ignore_errors=True)
    return kept


@functools.cache
def made(program, *verbs):
    """A read-only folder in which these command lines of the program were run one after the other. The first caller creates it; concurrent
    callers wait."""
    program = os.path.abspath(program)
    folder = shelf(program) / hashlib.sha256("\n".join(verbs).encode()).hexdigest()[:16]
    before = made(program, *verbs[:-1]) if len(verbs) > 1 else None
    folder.parent.mkdir(parents=True, exist_ok=True)
    with open(folder.with_suffix(".lock"), "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            begun = pathlib.Path(tempfile.mkdtemp(prefix="begun-", dir=folder.parent))
            if before:
                shutil.copytree(before, begun, dirs_exist_ok=True)
            done = subprocess.run([program, *verbs[-1].split()], cwd=begun, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300, check=False)
            if done.returncode != 0:
                shutil.rmtree(begun)
                raise AssertionError(f"{verbs[-1]}: exit {done.returncode}\n{done.stderr}")
            begun.rename(folder)
    return folder
