#!/usr/bin/python3
"""First drives of the plant: the correct robot passes, and each swapped sign, axis and unit is reported.

    tests/plant/commission_test.py build/check/bin/waymark
"""
import os
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import course
import wrong_wiring
from waymark_runs import Place, Run, process

SHORT = ["gyro_reversed"]  # of the short test run


def first_drive(place: Place, *options: str) -> Run:
    robot = process(["--camera", "corners", *options], place.folder / "drive.csv")
    return place.waymark("commission", "--robot", robot, "--robot-file", "robot.yaml", "--yes", "--tag-size-m", str(course.TAG_SIZE_M), "--json",
                         "-o", "commissioned.yaml")


def failures(run: Run) -> list[str]:
    return [f"{found['check']}: {found['message']}" for found in run.report["findings"] if found["level"] == "fail"]


def check(name: str, run: Run, right: bool) -> bool:
    print(f"{'ok  ' if right else 'FAIL'} {name}: exit {run.code}; {'; '.join(failures(run)) if run.report else run.err}", flush=True)
    return right


def main() -> int:
    full = bool(os.environ.get("WAYMARK_FULL"))
    right = True
    with tempfile.TemporaryDirectory() as scratch:
        place = Place(sys.argv[1], pathlib.Path(scratch))
        good = [["--plant", "kinematic"]]
        if full:
            good += [["--plant", "mujoco"], ["--plant", "kinematic", "--odometry", "wheels", "--no-imu"], ["--turn-gain", "0.3"]]
        for options in good:
            run = first_drive(place, *options)
            scales = run.report.get("figures", {})
            print(scales)
            sees = 0.8 < scales.get("speed_scale", 0) < 1.1 and 0.2 < scales.get("yaw_rate_scale", 0) < 0.9
            right &= check(" ".join(options), run, run.code == 0 and not failures(run) and sees)
        for name in sorted(wrong_wiring.NAMED) if full else SHORT:
            run = first_drive(place, "--wrong", name)
            named = any(wrong_wiring.NAMED[name] in text for text in failures(run))
            blamed = name in wrong_wiring.SENT and any(words.startswith("command.") for words in failures(run))
            right &= check(name, run, run.code == 1 and named and not blamed)
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
