#!/usr/bin/python3
"""Maps of rooms with duplicate and moved tags (`duplicate_scenes.py`): is each duplicate named, and nothing else, and is the map as accurate as its
covariances state? Without CASES: five cases; with WAYMARK_FULL=1: all of them with three seeds.

    tests/plant/duplicates_test.py build/check/bin/waymark [CASES]
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import duplicate_scenes
import judge

SHORT = ["far", "touching", "moved-back", "odometry-jump", "trolley"]
RMSE_M, OPEN_RMSE_M = 0.015, 0.045  # of the tags; of an open chain
SIGMAS, SYSTEMATIC_M = 5.0, 0.002
ACROSS_M = 0.1  # of the reported places of a duplicate


def number_of(entry) -> int:
    return int(str(entry["tag"]).split(":")[-1])


def covariances(file: pathlib.Path) -> dict[int, np.ndarray]:
    """The covariance of each tag of a map.yaml, 21 numbers: the upper triangle row by row."""
    found: dict[int, np.ndarray] = {}
    number = -1
    for line in file.read_text().replace(",\n", ",").splitlines():
        key, _, value = line.strip().lstrip("- {").partition(":")
        if key == "tag":
            number = int(value.strip(' "').split(":")[1])
        elif key == "covariance" and number >= 0:
            upper = np.zeros((6, 6))
            upper[np.triu_indices(6)] = json.loads(value)
            found[number] = upper + np.triu(upper, 1).T
    return found


def wrong_names(scene: duplicate_scenes.Scene, summary) -> list[str]:
    faults = []
    named = sorted({number_of(entry) for entry in summary["duplicate_ids"]})
    moved = sorted(number_of(entry) for entry in summary["moved_tags"])
    if named != scene.duplicates:
        faults.append(f"duplicates {named}, not {scene.duplicates}")
    if moved != scene.moved:
        faults.append(f"moved {moved}, not {scene.moved}")
    if summary["wrong_sizes"]:
        faults.append(f"wrong sizes {summary['wrong_sizes']}")
    wrong_odometry = 1 if scene.case == "odometry-jump" else 0
    if scene.odom_T_rig and len(summary["rejected_odometry"]) != wrong_odometry:
        faults.append(f"rejected odometry {summary['rejected_odometry']}")
    return faults


def mapped_places(scene: duplicate_scenes.Scene, mapped) -> dict[int, np.ndarray]:
    """The true place of each mapped tag; of those of a duplicate, the one nearest to the map."""
    single = [n for n in mapped if len(scene.places.get(n, [])) == 1]
    _, turned, shift = judge.align(np.array([mapped[n][:3, 3] for n in single]), np.array([scene.places[n][0] for n in single]))
    chosen = {}
    for n in set(mapped) & set(scene.places):
        found = turned @ mapped[n][:3, 3] + shift
        chosen[n] = min(scene.places[n], key=lambda place, found=found: float(np.linalg.norm(place - found)))
    return chosen


def wrong_positions(scene: duplicate_scenes.Scene, out: pathlib.Path) -> tuple[list[str], float]:
    """The faults, and the RMSE of the tags [m]."""
    mapped, variances = judge.read_map(out / "map.yaml"), covariances(out / "map.yaml")
    faults = [f"tag {n} is not in the map" for n in sorted(set(scene.places) - set(mapped))]
    chosen = mapped_places(scene, mapped)
    ids = sorted(chosen)
    true, found = np.array([chosen[n] for n in ids]), np.array([mapped[n][:3, 3] for n in ids])
    _, turned, shift = judge.align(found, true)
    errors = judge.errors(np.linalg.norm(found @ turned.T + shift - true, axis=1))
    limit = OPEN_RMSE_M if scene.case.endswith("-one") else RMSE_M
    if errors.rmse_m > limit or errors.max_m > 4 * limit:
        faults.append(f"tags {errors.cm()} cm")
    faults += [f"tag {n} has no covariance" for n in ids if n not in variances and n not in scene.given]
    if scene.given and not set(scene.given) & set(scene.duplicates):
        faults += inconsistent(chosen, mapped, variances)
    return faults, errors.rmse_m


def inconsistent(chosen, mapped, variances) -> list[str]:
    """Tags whose position errors are larger than their covariances in the left tangent allow."""
    faults = []
    for n in sorted(set(chosen) & set(variances)):
        x, y, z = mapped[n][:3, 3]
        lever = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
        sigma_m = float(np.sqrt(np.trace(lever @ variances[n] @ lever.T)))
        off_m = float(np.linalg.norm(mapped[n][:3, 3] - chosen[n]))
        if off_m > SIGMAS * sigma_m + SYSTEMATIC_M:
            faults.append(f"tag {n} is {1000 * off_m:.0f} mm off, {off_m / sigma_m:.1f} sigma")
    return faults


def wrong_places(scene: duplicate_scenes.Scene, summary) -> list[str]:
    """Reported places of duplicates at which there is no print."""
    if not scene.given or set(scene.given) & set(scene.duplicates) or scene.case.endswith("-one"):
        return []
    faults = []
    for entry in summary["duplicate_ids"]:
        for key in ("position_m", "other_position_m"):
            off_m = min((float(np.linalg.norm(place - entry[key])) for place in scene.places.get(number_of(entry), [])), default=np.inf)
            if off_m > ACROSS_M:
                faults.append(f"{key} of {entry['tag']} is {off_m:.2f} m from any print")
    return faults


def run(program: str, case: str, seed: int, folder: pathlib.Path) -> bool:
    scene = duplicate_scenes.build(case, seed)
    duplicate_scenes.write(folder, scene)
    done = subprocess.run([program, "map", "scene", str(folder / "tags.db3"), "--tagslam", str(folder), "-o", str(folder / "out"), "--json"],
                          capture_output=True, text=True, timeout=600, check=False)
    if done.returncode != 0:
        print(f"{case:14} {seed}: exit code {done.returncode}: {done.stderr.strip()[-300:]}")
        return False
    summary = json.loads(done.stdout.strip().splitlines()[-1])
    faults, rmse_m = wrong_positions(scene, folder / "out")
    faults += wrong_names(scene, summary) + wrong_places(scene, summary)
    print(f"{case:14} {seed}: {1000 * rmse_m:.1f} mm, {summary['rejected_observations']} of {summary['observations']} observations rejected"
          + "".join("\n    " + fault for fault in faults), flush=True)
    return not faults


def main() -> int:
    program, cases = sys.argv[1], sys.argv[2:]
    full = "WAYMARK_FULL" in os.environ
    cases = cases or (list(duplicate_scenes.CASES) if full else SHORT)
    with tempfile.TemporaryDirectory() as folder:
        right = [run(program, case, seed, pathlib.Path(folder) / f"{case}-{seed}") for case in cases for seed in range(1, 4 if full else 2)]
    print(f"{sum(right)} of {len(right)} maps are right")
    return 0 if all(right) else 1


if __name__ == "__main__":
    sys.exit(main())
