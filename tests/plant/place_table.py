#!/usr/bin/python3
"""The table "A place that is not as it is taken to be" of docs/results-second-judge.md: a leaning anchor, a camera mounting that differs
from its file, wheels without turn information, few tags. Taught as by a person: only the id of the anchor is given.

    tests/plant/place_table.py build/release/bin/waymark --write docs/results-second-judge.md
"""
import argparse
import dataclasses
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import lap_test
from table import replace_table
from waymark_runs import Place

BEGIN, END = "<!-- place table -->", "<!-- end of place table -->"


@dataclasses.dataclass(frozen=True)
class Row:
    name: str
    options: tuple[str, ...] = ()


def mounting(*off: float) -> tuple[str, ...]:
    return ("--mounting", *(str(number) for number in off))


SMALL, LARGE = (0.01, 0, 0.005, 0, 1.15, 0), (0.02, 0, 0, 0, 2, 0)
WHEELS = ("--odometry", "wheels", "--no-imu")
ROWS = [
    Row("upright anchor"),
    *(Row(f"anchor tilted by {lean} degrees", ("--lean-deg", str(lean))) for lean in (0.3, 1, 3, 6, 15, 30)),
    Row("MuJoCo, anchor tilted by 3 degrees", ("--plant", "mujoco", "--lean-deg", "3")),
    Row("camera 1 cm forward, 0.5 cm up, 1.15 degrees down, not configured", mounting(*SMALL)),
    Row("camera 2 cm forward, 2 degrees down, not configured", mounting(*LARGE)),
    Row("camera 2 cm forward, 2 degrees to the left, not configured", mounting(0.02, 0, 0, 0, 0, 2)),
    Row("MuJoCo, camera 2 cm forward, 2 degrees down, not configured", ("--plant", "mujoco", *mounting(*LARGE))),
    *(Row(f"wheels only, gain {gain}", ("--turn-gain", str(gain), *WHEELS)) for gain in (0.2, 0.3, 1.2)),
    *(Row(f"wheels only, gain 0.3, {tags} tags", ("--turn-gain", "0.3", "--tags", str(tags), *WHEELS)) for tags in (15, 12)),
    Row("the same with an IMU", ("--turn-gain", "0.3", "--tags", "12", "--odometry", "wheels")),
    Row("MuJoCo, wheels only, 12 tags", ("--plant", "mujoco", "--tags", "12", *WHEELS)),
]


def cells(row: Row, args: argparse.Namespace, folder: pathlib.Path) -> str:
    options = ["--camera", "corners", *row.options]
    lap = lap_test.drive(Place(args.program, folder), options, 0.25, args.seed, args.fast)
    tags = lap.map_errors.cm() if lap.map_errors else "none"
    if not lap.mapped:
        return f"| {row.name} | none | none | {lap.words} |"
    end = "done" if lap.finished else f"{lap.words} after {lap.driven_m:.1f} m"
    return f"| {row.name} | {tags} | {lap.replay_errors.cm()} | {end} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program waymark")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", nargs="+", help="only rows whose name contains one of these")
    parser.add_argument("--fast", action="store_true", help="teach faster than the clock: then the pose of an upright anchor is given")
    parser.add_argument("--folder", type=pathlib.Path, help="keep recordings, maps and truths here")
    parser.add_argument("--write", type=pathlib.Path, help="replace the table in this file")
    args = parser.parse_args()
    lines = ["| what | tags (aligned) RMSE / max cm | replay RMSE / max cm | |", "|---|---|---|---|"]
    for number, row in enumerate(ROWS):
        if args.rows and not any(word in row.name for word in args.rows):
            continue
        with tempfile.TemporaryDirectory() as scratch:
            lines.append(cells(row, args, args.folder / str(number) if args.folder else pathlib.Path(scratch)))
        print(lines[-1], file=sys.stderr, flush=True)
    print("\n".join(lines))
    if args.write:
        replace_table(args.write, lines, BEGIN, END)


if __name__ == "__main__":
    main()
