"""Runs a solution of the exercise and scores it."""

import json
import math
import sys
import traceback

from .robot import TAG_FILE, Finished, Robot
from .score import Score
from .stand_ins import installed


def run_file(path, seconds=60.0, seed=1, camera_rate_hz=10.0):
    """Runs the file of a solution for so many simulated seconds and returns its score as a dictionary; `error` is the traceback of an
    exception that ended it, else None."""
    with open(path, encoding="utf-8") as file:
        code = compile(file.read(), path, "exec")
    score = Score()
    robot = Robot(score, seconds=seconds, seed=seed, camera_rate_hz=camera_rate_hz)
    error = None
    with installed(robot, TAG_FILE):
        try:
            exec(code, {"__name__": "__main__", "__file__": path})  # noqa: S102
        except Finished:
            pass
        except KeyboardInterrupt:  # what was driven until then is scored
            error = "stopped by Ctrl-C"
        except Exception:  # whatever a solution does wrong is part of its result
            error = traceback.format_exc()
    return {**score.result(), "error": error}


def main(arguments=None):
    import argparse

    parser = argparse.ArgumentParser(prog="python3 -m waymark.academy", description="Run and score a solution of the exercise Marker Based Visual Loc.")
    parser.add_argument("solution", help="Python file of the solution")
    parser.add_argument("--seconds", type=float, default=60, help="simulated time (default 60)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the simulation (default 1)")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of words")
    chosen = parser.parse_args(arguments)
    if not (math.isfinite(chosen.seconds) and 0 < chosen.seconds <= 3600):
        parser.error("--seconds is a time above 0 and at most 3600")
    try:
        result = run_file(chosen.solution, chosen.seconds, chosen.seed)
    except (OSError, SyntaxError, UnicodeDecodeError) as failure:
        print(f"{chosen.solution}: {failure}", file=sys.stderr)
        return 1
    if chosen.json:
        print(json.dumps({key: None if isinstance(value, float) and math.isnan(value) else value for key, value in result.items()}))
    else:
        for name, value in result.items():
            if name != "error":
                print(f"{name:<20}{value}")
        if result["error"]:
            print(result["error"], file=sys.stderr)
    return 1 if result["error"] else 0
