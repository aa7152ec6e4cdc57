#!/usr/bin/python3
"""Random faults while a route is repeated on a plant, and whether there was unwanted motion.

    tests/plant/faults.py build/release/bin/waymark --scripts 300 --seed 1

Contradicting sensors: zero is commanded within 1.5 s of the onset, the robot moves at most 15 cm after the first second, and does not
start again. Blindness: at most 1.5 s without images, 0.6 m in the dark. Any fault: at most 0.3 m from the taught trajectory."""
import argparse
import collections
import concurrent.futures
import dataclasses
import json
import math
import os
import pathlib
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import fault_script
import judge
from table import replace_table
from waymark_runs import Place

CONTRADICTIONS = ("stuck_feed", "held", "blocked", "spinning", "carried_slowly", "carried", "encoder_stuck", "gyro_stuck")
MOVES_ON = ("latency", "gain_step", "clock_jump")  # may continue if it stays on its path
WINDOW_S, WITHIN_S, FARTHER_M, DARK_M, OFF_ROUTE_M = 1.0, 1.5, 0.15, 0.6, 0.3


@dataclasses.dataclass
class Verdict:
    fault: str
    kind: str
    right: bool
    onset_s: float | None  # None: no contradiction, or the robot was stationary already
    zero_after_s: float | None  # last nonzero command, after the onset
    travel_m: float | None  # true distance after the onset
    off_route_m: float
    words: str


def onset_s(truth: np.ndarray, fault: fault_script.Fault) -> float | None:
    """The onset of the fault: sources differ by 5 cm or 5 degrees within a second."""
    after = truth[truth[:, 0] >= fault.start_s]
    if fault.kind == "carried_slowly":
        return fault.start_s + 0.05 / 0.03
    if fault.kind != "gyro_stuck":
        return fault.start_s
    rows = round(WINDOW_S / 0.02)
    yaw = np.unwrap(after[:, 3])
    stuck_rate = (truth[np.searchsorted(truth[:, 0], fault.start_s) - 1, 3] - truth[np.searchsorted(truth[:, 0], fault.start_s) - 6, 3]) / 0.1
    differs = np.flatnonzero(np.abs(yaw[rows:] - yaw[:-rows] - stuck_rate * WINDOW_S) > math.radians(5))
    return float(after[differs[0] + rows, 0]) if len(differs) else None


def was_stationary(truth: np.ndarray, fault: fault_script.Fault) -> bool:
    """The robot was not commanded to move when the fault began: a stop without a reason."""
    after = truth[truth[:, 0] >= fault.start_s]
    return len(after) == 0 or bool(np.all(np.abs(after[:5, 4]) < 1e-6))


def own_motion(truth: np.ndarray, fault: fault_script.Fault) -> np.ndarray:
    """x and y without the motion by hand."""
    carried = np.array([fault_script.carried([fault], t) for t in truth[:, 0]])
    return truth[:, 1:3] - carried


def judge_run(taught: np.ndarray, truth: np.ndarray, fault: fault_script.Fault, words: str, text: str) -> Verdict:
    stationary = was_stationary(truth, fault)
    onset = None if stationary else onset_s(truth, fault)
    free = own_motion(truth, fault)
    off_route = judge.tracking(taught, np.column_stack([truth[:, 0], free, truth[:, 3:]])).max_m
    verdict = Verdict(text, fault.kind, off_route <= OFF_ROUTE_M and not stationary, onset, None, None, off_route, words)
    if onset is None:
        return verdict
    ordered = np.flatnonzero((truth[:, 4:6] != 0).any(axis=1) & (truth[:, 0] > onset))
    verdict.zero_after_s = float(truth[ordered[-1], 0] - onset) if len(ordered) else 0.0
    verdict.travel_m = way(free[truth[:, 0] >= onset])
    if fault.kind in CONTRADICTIONS:
        farther = way(free[truth[:, 0] >= onset + WINDOW_S])
        verdict.right = verdict.zero_after_s <= WITHIN_S and farther <= FARTHER_M
    elif fault.kind == "camera_unplugged":
        verdict.right = verdict.zero_after_s <= WITHIN_S
    elif fault.kind == "dark":
        verdict.right = verdict.travel_m <= DARK_M
    return verdict


def way(points: np.ndarray) -> float:
    return float(np.hypot(*np.diff(points[::5], axis=0).T).sum()) if len(points) > 5 else 0.0


def script(rng: np.random.Generator, kinds: list[str]) -> str:
    return f"{kinds[rng.integers(len(kinds))]}@{rng.uniform(6, 30):.2f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program waymark")
    parser.add_argument("--scripts", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plant", choices=["kinematic", "mujoco"], default="kinematic")
    parser.add_argument("--odometry", choices=["gyro", "wheels"], default="gyro")
    parser.add_argument("--speed-m-s", type=float, default=0.3)
    parser.add_argument("--kinds", nargs="+", choices=list(fault_script.KINDS), default=list(fault_script.KINDS))
    parser.add_argument("--each", action="store_true", help="each kind in turn instead of at random")
    parser.add_argument("--turn-gain", type=float, help="kinematic plant: of all scripts, instead of one of 0.3, 0.6, 1.0 at random")
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER", help="of the scripts, to drive one again")
    parser.add_argument("--jobs", type=int, default=1, help="scripts at a time")
    parser.add_argument("--test", action="store_true", help="as ctest runs it: a stuck feed and an unplugged camera on the kinematic plant; with "
                        "WAYMARK_FULL 300 scripts on MuJoCo, as many at a time as there are processors")
    parser.add_argument("--folder", type=pathlib.Path, help="keep the files here; an existing map is used again")
    parser.add_argument("--write", type=pathlib.Path, help="replace the table of this plant in this file")
    parser.add_argument("--may-fail", action="store_true", help="exit 0 regardless of the result")
    args = parser.parse_args()
    if args.test and os.environ.get("WAYMARK_FULL"):
        args.plant, args.scripts, args.jobs = "mujoco", 300, os.cpu_count() or 1
    elif args.test:
        args.kinds, args.each, args.scripts, args.turn_gain, args.jobs = ["stuck_feed", "camera_unplugged"], True, 2, 0.6, 2
    with tempfile.TemporaryDirectory() as scratch:
        verdicts = run_all(args, args.folder or pathlib.Path(scratch))
    print(fault_table(verdicts))
    if args.write:
        of = "" if args.plant == "kinematic" else " MuJoCo"
        replace_table(args.write, fault_table(verdicts).splitlines(), f"<!-- fault table{of} -->", f"<!-- end of fault table{of} -->")
    return 0 if args.may_fail or all(verdict.right for verdict in verdicts) else 1


def run_all(args: argparse.Namespace, folder: pathlib.Path) -> list[Verdict]:
    scripts = {number: drawn(args, number) for number in args.only or range(args.scripts)}
    places = {gain: taught(args, gain, folder) for gain in sorted({gain for gain, _ in scripts.values()})}
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        return list(pool.map(lambda number: run_one(args, number, places[scripts[number][0]], *scripts[number]), scripts))


def drawn(args: argparse.Namespace, number: int) -> tuple[float, str]:
    """Yaw gain (0: the plant has no such parameter) and script."""
    rng = np.random.default_rng([args.seed, number])
    gain = float(rng.choice([0.3, 0.6, 1.0])) if args.plant == "kinematic" else 0.0
    text = script(rng, [args.kinds[number % len(args.kinds)]] if args.each else args.kinds)
    return (args.turn_gain or gain) if args.plant == "kinematic" else 0.0, text


def options_of(args: argparse.Namespace, gain: float) -> list[str]:
    return ["--plant", args.plant, "--camera", "corners", "--odometry", args.odometry] + (["--turn-gain", str(gain)] if gain else [])


def taught(args: argparse.Namespace, gain: float, folder: pathlib.Path) -> Place:
    place = Place(args.program, folder / f"gain-{gain}")
    if (place.folder / "map" / "map.yaml").exists():
        return place
    if place.teach_fast([*options_of(args, gain), "--seed", "1"]).code or place.map().code:
        raise RuntimeError("the lap was not taught and mapped")
    return place


def run_one(args: argparse.Namespace, number: int, place: Place, gain: float, text: str) -> Verdict:
    name = f"script-{number}"
    run = place.replay([*options_of(args, gain), "--seed", str(1000 + number), "--fault", text, "--limit-s", "120"], "--speed-m-s",
                       str(args.speed_m_s), name=name)
    words = str(run.report.get("reason", "")) or (run.err.strip().splitlines() or [""])[-1]
    verdict = judge_run(judge.read_truth(place.folder / "lap.csv"), judge.read_truth(place.folder / f"{name}.csv"), fault_script.parse(text),
                        words, text)
    print(json.dumps({"script": number, "turn_gain": gain, "exit": run.code, **dataclasses.asdict(verdict)}), file=sys.stderr, flush=True)
    return verdict


def fault_table(verdicts: list[Verdict]) -> str:
    groups = collections.defaultdict(list)
    for verdict in verdicts:
        groups[verdict.kind].append(verdict)
    lines = ["| fault | scripts | passed | last nonzero command after s, median / max | distance after the onset m, median / max | distance from the taught path m |",
             "|---|---|---|---|---|---|"]
    for kind, group in sorted(groups.items()):
        times = [v.zero_after_s for v in group if v.zero_after_s is not None]
        ways = [v.travel_m for v in group if v.travel_m is not None]
        lines.append(f"| {kind} | {len(group)} | {sum(v.right for v in group)} | {middle_and_most(times)} | {middle_and_most(ways)} "
                     f"| {max(v.off_route_m for v in group):.2f} |")
    return "\n".join(lines)


def middle_and_most(values: list[float]) -> str:
    return f"{np.median(values):.2f} / {max(values):.2f}" if values else "none"


if __name__ == "__main__":
    sys.exit(main())
