#!/usr/bin/python3
"""No map is silently wrong: recordings with random injected causes, and clean ones, mapped and judged by `map_properties.py`. Without WAYMARK_FULL a
few seeds. WAYMARK_FULL=1 runs WAYMARK_SEEDS seeds of laps and of scenes from WAYMARK_FIRST_SEED on, and a fifth as many clean recordings. The table
of the runs is written into the folder.

    tests/plant/map_properties_test.py build/check/bin/waymark FOLDER
"""
import dataclasses
import os
import pathlib
import shutil
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import map_properties

FULL = "WAYMARK_FULL" in os.environ
FIRST = int(os.environ.get("WAYMARK_FIRST_SEED", 1))
SEEDS = int(os.environ.get("WAYMARK_SEEDS", 125))
CLEAN_SHARE = 5
SHORT = {("lap", "random"): [5, 14], ("lap", "none"): [1], ("scene", "random"): [1, 7], ("scene", "none"): [2]}
# Faults of 500 runs that remain, at most five, each with its cause: (kind, choice, seed): "cause".
KNOWN: dict[tuple[str, str, int], str] = {}
MOST_KNOWN = 5


def seeds_of(kind: str, choice: str) -> list[int]:
    if not FULL:
        return SHORT[kind, choice]
    first, count = ((FIRST - 1) // CLEAN_SHARE + 1, SEEDS // CLEAN_SHARE) if choice == "none" else (FIRST, SEEDS)
    return list(range(first, first + count))


def judge_finds_errors(program: str, folder: pathlib.Path) -> bool:
    """The same map is silent about a tag that is elsewhere, and about poses that are elsewhere."""
    place = folder / "judged"
    truth, right = map_properties.run(program, "lap", SHORT["lap", "none"][0], "none", place)
    other_tag = dataclasses.replace(truth, places=truth.places | {5: [truth.places[5][0] + [0.3, 0, 0]]})
    other_poses = dataclasses.replace(truth, poses=truth.poses + [[0, 0, 0, 0.1], [0] * 4, [0] * 4, [0] * 4])
    verdicts = [map_properties.outcome(other, False, 0, place).verdict for other in (other_tag, other_poses)]
    shutil.rmtree(place)
    print(f"judged without errors: {right.verdict}; with a wrong tag and with wrong poses: {verdicts}")
    return right.verdict == "right" and verdicts == ["SILENT", "SILENT"]


def main() -> int:
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    unexpected = [] if judge_finds_errors(program, folder) else ["the judge does not find errors"]
    with open(folder / f"seeds-{FIRST}.txt" if FULL else folder / "short.txt", "w", encoding="utf-8") as table:
        for kind, choice in SHORT:
            for run in map_properties.judge_seeds(program, kind, seeds_of(kind, choice), choice, folder):
                print(run.line, flush=True)
                print(run.line, file=table, flush=True)
                if run.is_fault and (kind, choice, run.seed) not in KNOWN:
                    unexpected.append(run.line)
    print(f"{len(unexpected)} faults" + "".join("\n  " + line for line in unexpected))
    return 1 if unexpected or len(KNOWN) > MOST_KNOWN else 0


if __name__ == "__main__":
    sys.exit(main())
