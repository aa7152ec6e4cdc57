#!/usr/bin/python3
"""The table of docs/results-second-judge.md: plants x odometry x speed, each lap taught, mapped and replayed, compared with the ground truth of the plant.

    tests/plant/table.py build/release/bin/waymark --write docs/results-second-judge.md

With --line: the table of laps on a recorded line with tight bends.
"""
import argparse
import dataclasses
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import lap_test
from waymark_runs import Place

BEGIN, END = "<!-- plant table -->", "<!-- end of plant table -->"
TIGHT = "<!-- tight table -->", "<!-- end of tight table -->"


@dataclasses.dataclass(frozen=True)
class Row:
    name: str
    options: tuple[str, ...]


ROWS = [
    *(Row(f"kinematic, gain {gain}, {odometry}", ("--plant", "kinematic", "--turn-gain", str(gain), "--odometry", odometry))
      for gain, odometry in ((0.6, "wheels"), (0.3, "gyro"), (1.0, "gyro"), (0.3, "wheels"))),
    *(Row(f"MuJoCo, {odometry}", ("--plant", "mujoco", "--odometry", odometry)) for odometry in ("gyro", "wheels")),
]


def cells(row: Row, args: argparse.Namespace, folder: pathlib.Path) -> str:
    place = Place(args.program, folder)
    of_line, map_words = lap_test.recorded(args.line)
    options = [*row.options, "--camera", args.camera, *of_line]
    lap = lap_test.drive(place, options, args.speeds[0], args.seed, args.fast, map_words)
    found = [lap.map_errors.cm() if lap.map_errors else "none", replay_cell(lap) if lap.mapped else "none"]
    for number, speed in enumerate(args.speeds[1:]):
        again = lap_test.Lap(map_errors=lap.map_errors)
        if lap.mapped:
            lap_test.replay(place, again, options, speed, args.seed + 2 + number)
        found.append(replay_cell(again) if lap.mapped else "none")
    return f"| {row.name} | {' | '.join(found)} |"


def replay_cell(lap: lap_test.Lap) -> str:
    return lap.replay_errors.cm() + ("" if lap.finished else f", stopped after {lap.driven_m:.1f} m")


def replace_table(file: pathlib.Path, lines: list[str], begin: str = BEGIN, end: str = END) -> None:
    before, _, rest = file.read_text().partition(begin)
    _, _, after = rest.partition(end)
    file.write_text(before + "\n".join([begin, *lines, end]) + after)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program waymark")
    parser.add_argument("--camera", choices=["corners", "images"], default="images")
    parser.add_argument("--speeds", type=float, nargs="+", default=[0.25, 0.5], metavar="M_S", help="of the replays")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--line", metavar="FILE", help="a recorded line instead of the lap, as that of lap_test.py")
    parser.add_argument("--rows", nargs="+", help="only rows whose name contains one of these")
    parser.add_argument("--as-a-person", dest="fast", action="store_false", help="teach by the clock, so that no recording holds the truth")
    parser.add_argument("--write", type=pathlib.Path, help="replace the table in this file")
    args = parser.parse_args()
    speeds = " | ".join(f"{speed} m/s RMSE / max cm" for speed in args.speeds)
    lines = [f"| plant, odometry | tags (aligned) RMSE / max cm | {speeds} |", "|---" * (2 + len(args.speeds)) + "|"]
    for row in ROWS:
        if args.rows and not any(word in row.name for word in args.rows):
            continue
        with tempfile.TemporaryDirectory() as folder:
            lines.append(cells(row, args, pathlib.Path(folder)))
        print(lines[-1], file=sys.stderr, flush=True)
    print("\n".join(lines))
    if args.write:
        replace_table(args.write, lines, *(TIGHT if args.line else (BEGIN, END)))


if __name__ == "__main__":
    main()
