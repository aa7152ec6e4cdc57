"""Runs a solution of the exercise in a separate process and scores its estimates."""

import json
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

from .journal import INTERRUPTED, read
from .score import score

LARGEST_BYTES = 10_000_000


def _checked(path, seconds, seed, camera_rate_hz, stall_s):
    """Returns the path of a valid Python file as text; raises OSError, SyntaxError or ValueError otherwise."""
    for name, value, largest in (("seconds", seconds, 3600), ("camera_rate_hz", camera_rate_hz, 1000), ("stall_s", stall_s, 86400)):
        if not (isinstance(value, (int, float)) and 0 < value <= largest):
            raise ValueError(f"{name} is {value}: expected a number above 0 and at most {largest}")
    if not (isinstance(seed, int) and 0 <= seed < 2**64):
        raise ValueError(f"seed is {seed}: expected a whole number from 0 to 2**64 - 1")
    file = pathlib.Path(path)
    if not file.exists():
        raise FileNotFoundError(f"{file} does not exist")
    if not file.is_file():
        raise ValueError(f"{file} is not a file: expected the Python file of a solution")
    if file.stat().st_size > LARGEST_BYTES:
        raise ValueError(f"{file} has {file.stat().st_size} bytes: expected the Python file of a solution")
    compile(file.read_bytes(), str(file), "exec")
    return str(file)


def _wait(process):
    """Waits for the end of the process; returns True if Ctrl-C ended it."""
    try:
        process.wait()
        return False
    except KeyboardInterrupt:  # a terminal sends it to the solution as well, a notebook does not
        for stop in (lambda: None, lambda: process.send_signal(signal.SIGINT), process.kill):
            stop()
            try:
                process.wait(1.0)
                return True
            except subprocess.TimeoutExpired:
                pass
        process.wait()
        return True
    finally:
        process.kill()


def _line_in(stack, path):
    """The position in the solution, from the text written by faulthandler."""
    name = path.encode("ascii", "backslashreplace").decode()
    lines = [line for file, line in re.findall(r'File "(.*)", line (\d+)', stack) if file == name]
    return f"line {lines[0]}" if lines else "a library that it calls"


def _ended(process, stack, path, stall_s):
    """The reason why a process ended before its solution."""
    if stack:
        return (f"the solution read no sensor for {stall_s:g} s of real time ({_line_in(stack, path)}): the robot was stopped. "
                "Call HAL.getImage(), HAL.getOdom() or HAL.getLaserData() in each iteration of the loop")
    if process.returncode < 0:
        return f"the process of the solution was terminated by {signal.Signals(-process.returncode).name}"
    return f"the solution ended its process with exit code {process.returncode}"


def _notes(images, error, refused):
    """Notes for the student about the score. refused: number of refused calls, and the reason for the first one."""
    finished = bool(images) and images[-1].finished
    if not finished and error != INTERRUPTED:
        s = images[-1].s if images else 0.0
        loop = ": does it have a loop (while True)?" if error is None else ""
        yield f"the file ended after {s:.1f} s of simulated time; the remaining time counts as without an estimate{loop}"
    count, first = refused
    if count > 1 or (count == 1 and first not in (error or "")):  # otherwise the error reports it
        yield f"{count} {'call was' if count == 1 else 'calls were'} refused and had no effect; the first: {first}"
    not_finite = sum(p.not_finite for p in images)
    if not_finite:
        yield f"{not_finite} estimates contained NaN or infinity and are treated as not shown"
    elif not any(p.estimate for p in images):
        yield "no estimate was shown: call WebGUI.showEstimatedPose((x, y, yaw))"


def run_file(path, seconds=60.0, seed=1, camera_rate_hz=10.0, stall_s=30.0):
    """Runs the file of a solution for `seconds` of simulated time, in a separate process, and returns its score as a dictionary. It contains the
    numbers from score(). `error` is the traceback of the exception or a description of the event that ended the solution, else None. `notes`
    are sentences about the score. A solution that reads no sensor for `stall_s` of real time is terminated.

    Raises OSError if the file cannot be read, SyntaxError if it is not Python, ValueError if a number is out of range."""
    path = _checked(path, seconds, seed, camera_rate_hz, stall_s)
    with tempfile.TemporaryFile() as journal, tempfile.TemporaryFile() as stall:
        task = {"path": path, "seconds": seconds, "seed": seed, "camera_rate_hz": camera_rate_hz, "stall_s": stall_s,
                "journal": journal.fileno(), "stall": stall.fileno()}
        process = subprocess.Popen([sys.executable, "-u", "-m", "waymark.academy.process", json.dumps(task)],
                                   pass_fds=(journal.fileno(), stall.fileno()), env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
        interrupted = _wait(process)
        images, end, refused = read(journal)
        stall.seek(0)
        stack = stall.read().decode(errors="replace")
    finished = bool(images) and images[-1].finished
    if interrupted:
        error = INTERRUPTED
    elif end is not None:
        error = end["error"]
    else:
        error = None if finished else _ended(process, stack, path, stall_s)
    left = images[-1].left if images and error != INTERRUPTED else 0
    return {**score(images, left), "notes": list(_notes(images, error, refused)), "error": error}


def main(arguments=None):
    """The command python3 -m waymark.academy; returns its exit code."""
    import argparse

    parser = argparse.ArgumentParser(prog="python3 -m waymark.academy", description="Run and score a solution of the exercise Marker Based Visual Loc.",
                                     epilog="Exit code: 0 scored, 1 the solution raised an exception or was ended, 2 wrong arguments.")
    parser.add_argument("solution", help="Python file of the solution")
    parser.add_argument("--seconds", type=float, default=60, help="simulated time (default 60)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the simulation (default 1)")
    parser.add_argument("--stall-s", type=float, default=30, help="real time without reading a sensor after which the solution is ended [s] (default 30)")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text")
    chosen = parser.parse_args(arguments)
    try:
        result = run_file(chosen.solution, chosen.seconds, chosen.seed, stall_s=chosen.stall_s)
    except SyntaxError as failure:
        print(f"{chosen.solution}: {failure}", file=sys.stderr)
        return 1
    except (OSError, ValueError) as failure:
        parser.error(str(failure))
    if chosen.json:
        print(json.dumps({key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in result.items()}))
        return 1 if result["error"] else 0
    for name, value in result.items():
        if name not in ("error", "notes"):
            print(f"{name:<22}{value}")
    for note in result["notes"]:
        print(f"note: {note}", file=sys.stderr)
    if result["error"]:
        print(result["error"], file=sys.stderr)
    return 1 if result["error"] else 0
