#!/usr/bin/python3
"""One lap on a plant that shares no code with Waymark's simulator: teach, map, replay, compared with the ground truth of the plant.

    tests/plant/lap_test.py build/check/bin/waymark --plant mujoco --camera images

Options that are not listed go to robot.py, as --lean-deg, --mounting, --tags and --no-imu.
"""
import argparse
import dataclasses
import json
import os
import pathlib
import resource
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import course
import judge
from waymark_runs import Place, Run


@dataclasses.dataclass
class Lap:
    """Results of one lap; None for steps that were not reached."""
    map_errors: judge.Errors | None = None
    replay_errors: judge.Errors | None = None
    driven_m: float = 0.0
    finished: bool = False
    words: str = ""

    @property
    def mapped(self) -> bool:
        return self.map_errors is not None


def drive(place: Place, options: list[str], speed_m_s: float, seed: int, fast: bool = False, map_words: tuple[str, ...] = (),
          replay_words: tuple[str, ...] = ()) -> Lap:
    """Teaches with `seed`; replays with the next seed from the start of the lap."""
    lap = Lap()
    teach = place.teach_fast if fast else place.teach
    taught = teach([*options, "--seed", str(seed)])
    if taught.code != 0:
        lap.words = last_words(taught)
        return lap
    mapped = place.map(*map_words)
    if mapped.code != 0:
        lap.words = last_words(mapped)
        return lap
    lap.map_errors = judge.tag_errors(judge.read_map(place.folder / "map" / "map.yaml"), course.tags(), anchored=False)
    replay(place, lap, options, speed_m_s, seed + 1, replay_words)
    return lap


def replay(place: Place, lap: Lap, options: list[str], speed_m_s: float, seed: int, words: tuple[str, ...] = ()) -> None:
    run = place.replay([*options, "--seed", str(seed)], "--speed-m-s", str(speed_m_s), *words)
    driven = judge.read_truth(place.folder / "replay.csv")
    lap.replay_errors = judge.tracking(judge.read_truth(place.folder / "lap.csv"), driven)
    lap.driven_m = judge.progress_m(driven)
    lap.finished = run.code == 0 and bool(run.report.get("finished"))
    lap.words = last_words(run)


def last_words(run: Run) -> str:
    reason = str(run.report.get("reason", ""))
    lines = [line for line in run.err.splitlines() if line.strip()]
    return reason or (lines[-1] if lines else f"exit {run.code}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program waymark")
    parser.add_argument("--plant", choices=["kinematic", "mujoco"], default="mujoco")
    parser.add_argument("--camera", choices=["corners", "images"], default="images")
    parser.add_argument("--odometry", choices=["gyro", "wheels"], default="gyro")
    parser.add_argument("--turn-gain", type=float, default=0.6, help="of the kinematic plant")
    parser.add_argument("--speed-m-s", type=float, default=0.25, help="of the replay")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--line", metavar="FILE", help="a recorded line (s, x, y, theta, curvature) instead of the lap, or the name of one of "
                        "WAYMARK_DATA's paths")
    parser.add_argument("--fast", action="store_true", help="teach faster than the clock; the recording then holds the truth")
    parser.add_argument("--folder", type=pathlib.Path, help="keep recordings, map and truth here")
    parser.add_argument("--tags-rmse-cm", type=float, help="fail when the tags' error is larger (aligned)")
    parser.add_argument("--rmse-cm", type=float, help="fail when the distance from the taught way is larger")
    parser.add_argument("--max-cm", type=float, help="the same for its largest")
    args, of_robot = parser.parse_known_args()
    options = ["--plant", args.plant, "--camera", args.camera, "--odometry", args.odometry, "--turn-gain", str(args.turn_gain), *of_robot]
    if args.line and not line_file(args.line).exists():
        print(f"skipped: {line_file(args.line)} does not exist (WAYMARK_DATA)")
        return 1 if os.environ.get("WAYMARK_REQUIRE_DATA") else 77
    of_line, map_words = recorded(args.line)
    options += of_line
    with tempfile.TemporaryDirectory() as scratch:
        lap = drive(Place(args.program, args.folder or pathlib.Path(scratch)), options, args.speed_m_s, args.seed, args.fast, map_words)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(json.dumps({"cpu_s": round(used.ru_utime + used.ru_stime, 1), **dataclasses.asdict(lap)}, indent=1))
    return 0 if lap.finished and within(lap, args) else 1


def line_file(line: str) -> pathlib.Path:
    return pathlib.Path(line) if line.endswith(".csv") else pathlib.Path(os.environ.get("WAYMARK_DATA", "/nonexistent")) / f"paths/{line}.csv"


def recorded(line: str | None) -> tuple[list[str], tuple[str, ...]]:
    """Uses a recorded line as the course: options of robot.py, and of `map`, which must not close the route."""
    if not line:
        return [], ()
    course.use_recorded(line_file(line))
    return ["--line", str(line_file(line).resolve())], ("--closing-distance-m", "0")


def within(lap: Lap, args: argparse.Namespace) -> bool:
    limits = [(lap.map_errors.rmse_m, args.tags_rmse_cm), (lap.replay_errors.rmse_m, args.rmse_cm), (lap.replay_errors.max_m, args.max_cm)]
    return all(limit is None or 100 * found <= limit for found, limit in limits)


if __name__ == "__main__":
    sys.exit(main())
