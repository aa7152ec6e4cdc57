"""Runs a solution of the exercise and scores it."""

import json
import math
import sys
import traceback

from .robot import TAG_FILE, Finished, Robot, Stalled
from .score import Score
from .stand_ins import installed
from .time_limit import limited

INTERRUPTED = "stopped by Ctrl-C"


def _notes(robot, score, ended_early):
    """What a student should know about the score."""
    if ended_early:
        yield f"the file ended after {robot.now_s:.1f} s of simulated time, and what is left counts as without an estimate: does it have a loop (while True)?"
    if score.not_finite:
        yield f"{score.not_finite} estimates held NaN or infinity, and count as not shown"
    if not score.trace and not score.not_finite:
        yield "no estimate was shown: WebGUI.showEstimatedPose((x, y, yaw))"


def run_file(path, seconds=60.0, seed=1, camera_rate_hz=10.0, stall_s=30.0):
    """Runs the file of a solution for so many simulated seconds and returns its score as a dictionary; `error` is the traceback of an
    exception that ended it, else None; `notes` are sentences about the score. A solution that asks no sensor for `stall_s` of real time
    is ended, where it runs in the main thread."""
    with open(path, encoding="utf-8") as file:
        code = compile(file.read(), path, "exec")
    score = Score()
    robot = Robot(score, seconds=seconds, seed=seed, camera_rate_hz=camera_rate_hz)
    error, ended_early = None, False
    with installed(robot, TAG_FILE):
        try:
            with limited(robot, path, stall_s):
                exec(code, {"__name__": "__main__", "__file__": path})  # noqa: S102
            ended_early = not robot.finished
        except Finished:
            pass
        except Stalled as stalled:
            error = None if robot.finished else str(stalled)
        except SystemExit:
            ended_early = not robot.finished
        except KeyboardInterrupt:  # what was driven until then is scored
            error = INTERRUPTED
        except Exception:  # whatever a solution does wrong is part of its result
            error = traceback.format_exc()
    robot.stop()
    left = 0 if error == INTERRUPTED else robot.pictures_left
    return {**score.result(left), "notes": list(_notes(robot, score, ended_early)), "error": error}


def main(arguments=None):
    import argparse

    parser = argparse.ArgumentParser(prog="python3 -m waymark.academy", description="Run and score a solution of the exercise Marker Based Visual Loc.")
    parser.add_argument("solution", help="Python file of the solution")
    parser.add_argument("--seconds", type=float, default=60, help="simulated time (default 60)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the simulation (default 1)")
    parser.add_argument("--stall-s", type=float, default=30, help="real time without a question to a sensor that ends the solution [s] (default 30)")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of words")
    chosen = parser.parse_args(arguments)
    if not (math.isfinite(chosen.seconds) and 0 < chosen.seconds <= 3600):
        parser.error("--seconds is a time above 0 and at most 3600")
    if not (math.isfinite(chosen.stall_s) and chosen.stall_s > 0):
        parser.error("--stall-s is a time above 0")
    try:
        result = run_file(chosen.solution, chosen.seconds, chosen.seed, stall_s=chosen.stall_s)
    except (OSError, SyntaxError, UnicodeDecodeError) as failure:
        print(f"{chosen.solution}: {failure}", file=sys.stderr)
        return 1
    if chosen.json:
        print(json.dumps({key: None if isinstance(value, float) and math.isnan(value) else value for key, value in result.items()}))
    else:
        for name, value in result.items():
            if name not in ("error", "notes"):
                print(f"{name:<22}{value}")
        for note in result["notes"]:
            print(f"note: {note}", file=sys.stderr)
        if result["error"]:
            print(result["error"], file=sys.stderr)
    return 1 if result["error"] else 0
