#!/usr/bin/python3
"""Is a map ever silently wrong? Maps recordings with random injected causes (`faulty_laps.py`, `faulty_scenes.py`) and judges each run: a map within
the bounds that its covariances state, a named cause, a refusal, or silence. A recording
without injected causes must give a map within the bounds and no warning.

    tests/plant/map_properties.py build/check/bin/waymark lap 1-40 --folder /tmp/laps
    tests/plant/map_properties.py build/check/bin/waymark scene 7 --folder /tmp/scenes --causes none"""
import argparse
import dataclasses
import json
import math
import pathlib
import shutil
import subprocess
import sys
import typing

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import duplicates_test
import faulty_laps
import faulty_scenes
import judge
import map_causes
from map_causes import Truth

KINDS = {"lap": faulty_laps, "scene": faulty_scenes}
POSE_SIGMAS, POSE_SHARE = 5.0, 0.01  # no larger share of poses is beyond
FAR_SIGMAS, FAR_POSE_M, FAR_TAG_M = 6.0, 0.05, 0.02  # no pose and no tag is beyond both
SAME_STAMP_NS = 1e6
LONGEST_S = 900
WORDS = 160  # characters of each warning in the table


@dataclasses.dataclass
class Worst:
    """`far`: beyond both bounds. A deviation is the distance over the standard deviation in its direction."""
    name: str = "-"
    off_m: float = 0.0
    sigmas: float = 0.0
    far: bool = False

    def take(self, name: str, off_m: float, sigmas: float, far: bool) -> None:
        if (far, off_m if far else sigmas) > (self.far, self.off_m if self.far else self.sigmas):
            self.name, self.off_m, self.sigmas, self.far = name, off_m, sigmas, far

    def __str__(self) -> str:
        return f"{self.name} {1000 * self.off_m:.0f} mm {self.sigmas:.1f} sigma"


@dataclasses.dataclass
class Outcome:
    verdict: str  # in capitals: a fault
    tag: Worst = dataclasses.field(default_factory=Worst)
    pose: Worst = dataclasses.field(default_factory=Worst)
    pose_share: float = 0.0  # of the poses beyond POSE_SIGMAS
    missing: list[int] = dataclasses.field(default_factory=list)  # tags that are not in the map
    unreal: list[int] = dataclasses.field(default_factory=list)  # tags of the map that do not exist
    named: list[str] = dataclasses.field(default_factory=list)
    accused: list[str] = dataclasses.field(default_factory=list)
    words: list[str] = dataclasses.field(default_factory=list)

    def is_within(self) -> bool:
        return not self.tag.far and not self.pose.far and self.pose_share <= POSE_SHARE and not self.unreal


def sigma_along(error: np.ndarray, covariance: np.ndarray) -> float:
    length = float(np.linalg.norm(error))
    direction = error / length if length > 0 else np.array([1.0, 0, 0])
    return math.sqrt(max(float(direction @ covariance @ direction), 1e-12))


def centre_covariance(position: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """3 x 3, of a tag's centre from its left tangent."""
    x, y, z = position
    lever = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
    return lever @ tangent @ lever.T


def judge_tags(truth: Truth, folder: pathlib.Path, found: Outcome) -> dict[int, float]:
    """Returns the standard deviations of the tags [m]."""
    mapped, tangents = judge.read_map(folder / "map.yaml"), duplicates_test.covariances(folder / "map.yaml")
    found.missing, found.unreal = sorted(set(truth.places) - set(mapped)), sorted(set(mapped) - set(truth.places))
    sigmas_m = {}
    for number in sorted(set(mapped) & set(truth.places)):
        position = mapped[number][:3, 3]
        error = min((position - place for place in truth.places[number]), key=np.linalg.norm)
        off_m = float(np.linalg.norm(error))
        covariance = centre_covariance(position, tangents[number]) if number in tangents else np.zeros((3, 3))
        sigmas = off_m / sigma_along(error, covariance)
        sigmas_m[number] = math.sqrt(np.trace(covariance))
        found.tag.take(f"tag {number}", off_m, sigmas if off_m > 1e-4 else 0.0, off_m > FAR_TAG_M and sigmas > FAR_SIGMAS)
    return sigmas_m


def read_poses(folder: pathlib.Path) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Stamps [ns], positions and, of a lap, the covariances of the positions."""
    rows = np.loadtxt(next(folder.glob("trajectory*.txt")), ndmin=2)
    table = folder / "trajectory_covariance.csv"
    if not table.exists():
        return 1e9 * rows[:, 0], rows[:, 1:4], None
    lower = np.loadtxt(table, delimiter=",", comments="#", ndmin=2)[:, 1:7]
    covariances = lower[:, [0, 1, 3, 1, 2, 4, 3, 4, 5]].reshape(-1, 3, 3)
    return 1e9 * rows[:, 0], rows[:, 1:4], covariances


def judge_poses(truth: Truth, folder: pathlib.Path, tag_sigmas_m: dict[int, float], found: Outcome) -> None:
    """If the program states no covariances of poses, those of one frame's corners and of its least certain tag replace them."""
    stamps_ns, positions, covariances = read_poses(folder)
    beyond = []
    for i, (stamp_ns, position) in enumerate(zip(stamps_ns, positions)):
        at = int(np.argmin(np.abs(truth.stamps_ns - stamp_ns)))
        if abs(truth.stamps_ns[at] - stamp_ns) > SAME_STAMP_NS:
            continue
        error = position - truth.poses[at][:3, 3]
        off_m = float(np.linalg.norm(error))
        if covariances is None:
            of_tags = [tag_sigmas_m[number] for number in truth.ids[at] if number in tag_sigmas_m]
            sigma_m = math.hypot(truth.deviations_m[at], max(of_tags, default=math.inf))
        else:
            sigma_m = sigma_along(error, covariances[i])
        beyond.append(off_m > POSE_SIGMAS * sigma_m)
        found.pose.take(f"{(stamp_ns - stamps_ns[0]) / 1e9:.1f} s", off_m, off_m / sigma_m, off_m > FAR_POSE_M and off_m > FAR_SIGMAS * sigma_m)
    found.pose_share = float(np.mean(beyond)) if beyond else 1.0


def verdict_of(clean: bool, code: int, found: Outcome) -> str:
    if clean and code != 0:
        return "REFUSED CLEAN"
    if clean and found.is_within() and found.words:
        return "ALARM"
    if code != 0:
        return "refused" if found.named else "refused, unnamed"
    if found.is_within():
        return "right, named" if found.named else "right"
    return "named" if found.named else "SILENT"


def run(program: str, kind: str, seed: int, choice: str, folder: pathlib.Path) -> tuple[Truth, Outcome]:
    """Writes the recording and the map into the folder."""
    truth = KINDS[kind].write(folder, seed, choice)
    try:
        done = subprocess.run([program, *KINDS[kind].command(folder)], capture_output=True, text=True, timeout=LONGEST_S, check=False)
    except subprocess.TimeoutExpired:
        return truth, Outcome("TOO LONG")
    (folder / "stdout.txt").write_text(done.stdout)
    (folder / "stderr.txt").write_text(done.stderr)
    if done.returncode not in (0, 1):
        return truth, Outcome(f"EXIT {done.returncode}")
    return truth, outcome(truth, choice == "none", done.returncode, folder)


def outcome(truth: Truth, clean: bool, code: int, folder: pathlib.Path) -> Outcome:
    """Judges what the program wrote into the folder."""
    report = json.loads((folder / "stdout.txt").read_text().strip().splitlines()[-1]) if code == 0 else {}
    words = report.get("warnings", [(folder / "stderr.txt").read_text().strip()])
    found = Outcome("", words=words, accused=map_causes.accused(truth.causes, report))
    found.named = [cause.kind for cause in truth.causes if map_causes.is_named(cause, report, words)]
    if code == 0:
        judge_poses(truth, folder / "out", judge_tags(truth, folder / "out", found), found)
    found.verdict = verdict_of(clean, code, found)
    return found


def row(kind: str, seed: int, truth: Truth, found: Outcome) -> str:
    causes = "; ".join(f"{cause.kind} {cause.what} {cause.amount}" for cause in truth.causes) or "none"
    unnamed = [cause.kind for cause in truth.causes if cause.kind not in found.named]
    outside = "".join(f" | {name} {numbers}" for name, numbers in (("missing", found.missing), ("no such tag", found.unreal)) if numbers)
    return (f"{kind} {seed} | {causes} | {found.verdict} | {found.tag} | {found.pose}, {100 * found.pose_share:.1f} %{outside} | "
            f"named {' '.join(found.named) or '-'}, not {' '.join(unnamed) or '-'}" + "".join(f" | not injected: {name}" for name in found.accused)
            + "".join(f" | {word[:WORDS]}" for word in found.words))


@dataclasses.dataclass
class Judged:
    seed: int
    is_fault: bool
    line: str


def judge_seeds(program: str, kind: str, seeds: list[int], choice: str, folder: pathlib.Path) -> typing.Iterator[Judged]:
    """A row for each seed. The recordings and maps of faults are kept."""
    for seed in seeds:
        place = folder / f"{kind}-{choice}-{seed}"
        truth, found = run(program, kind, seed, choice, place)
        is_fault = found.verdict.isupper()
        if not is_fault:
            shutil.rmtree(place)
        yield Judged(seed, is_fault, row(kind, seed, truth, found))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("seeds", help="such as 7 or 1-40")
    parser.add_argument("--folder", type=pathlib.Path, required=True, help="for recordings and maps; those of faults are kept")
    parser.add_argument("--causes", choices=map_causes.CHOICES, default="random")
    args = parser.parse_args()
    first, _, last = args.seeds.partition("-")
    faults = 0
    for judged in judge_seeds(args.program, args.kind, list(range(int(first), int(last or first) + 1)), args.causes, args.folder):
        print(judged.line, flush=True)
        faults += judged.is_fault
    print(f"{faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
