#!/usr/bin/python3
"""Localisation in generated logs: error and consistency by the second judge, over seeds, written into docs/results-second-judge.md.

    tests/plant/log_table.py build/release/bin/waymark --seeds 8 --write docs/results-second-judge.md
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import judge
import mcap_poses
import table

GENERATE = pathlib.Path(__file__).resolve().parent / "generate_log.py"
BEGIN, END = "<!-- log table -->", "<!-- end of log table -->"
CASES: dict[str, tuple[list[str], list[str]]] = {  # of the generator, of localize
    "clean, Gaussian": (["--clean"], []),
    "nominal: t corners, persistent errors, slip bursts, wandering bias and latency": ([], []),
    "one tag 3 cm off": (["--tag-off", "5", "0.03"], []),
    "one tag 0.5 m off": (["--tag-off", "5", "0.5"], []),
    "map without covariance, 2 mm and 0.2 deg": (["--no-covariance", "--map-sigma-m", "0.002", "--map-sigma-rad", "0.0035"], []),
    "focal length + 1 %": (["--focal-scale", "1.01"], []),
    "focal length + 3 %": (["--focal-scale", "1.03"], []),
    "mounting 2 cm, 3 cm, 2 deg off": (["--mounting", "0.02", "0.03", "0", "0", "0", "2"], []),
    "latency 60 ms, not configured": (["--latency-s", "0.06"], []),
    "latency 60 ms, configured": (["--latency-s", "0.06"], ["--camera-latency-s", "0.06"]),
    "encoders stuck twice for 3 s": (["--encoder-stuck", "15", "3", "--encoder-stuck", "35", "3"], []),
    "five tags 0.4 m off": (["--moved", "5", "0.4"], []),
    "five tags 0.4 m off, all the same way": (["--moved", "5", "0.4", "--moved-alike"], []),
    "stamps up to 30 ms too early or too late": (["--jitter-s", "0.03"], []),
    "wheels only, slip bursts": (["--odometry", "wheels", "--no-imu"], []),
    "a duplicate tag id": (["--second", "11", "5"], []),
    "ranges and bearings, noise not configured": (["--coarse"], []),
}


def run(program: str, folder: pathlib.Path, case: tuple[list[str], list[str]], seed: int) -> tuple[judge.TrajectoryErrors, list[str]]:
    """Errors and reported problems."""
    generate, words = case
    subprocess.run(["/usr/bin/python3", str(GENERATE), str(folder), "--seed", str(seed), *generate], check=True)
    coarse = "--coarse" in generate
    tables = ("ranges" if coarse else "detections", "odometry", *(() if "--no-imu" in generate else ("imu",)))
    logs = [str(folder / f"{name}.csv") for name in tables]
    where = ["--map", str(folder / ("landmarks.csv" if coarse else "map.yaml"))]
    where += ["--sensor-pose", "0", "0", "0"] if coarse else ["--robot", str(folder / "robot.yaml")]
    done = subprocess.run([program, "localize", *logs, *where, "-o", str(folder / "estimate.mcap"), "--json", *words],
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
    estimate, covariance = mcap_poses.read(folder / "estimate.mcap")
    late = estimate[:, 0] > estimate[0, 0] + json.loads(done.stdout.splitlines()[0])["first_fix_s"] + 1.0
    truth = np.loadtxt(folder / "truth.csv", delimiter=",", skiprows=1)
    truth[:, 0] *= 1e-9
    problems = json.loads(done.stdout.splitlines()[0])["problems"]
    return judge.trajectory_errors(truth[:, :4], estimate[late], covariance[late]), problems


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program waymark")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--cases", nargs="+", help="only cases whose name contains one of these")
    parser.add_argument("--write", type=pathlib.Path, help="replace the table in this file")
    args = parser.parse_args()
    lines = ["| log | RMSE m | largest m | RPE over 1 s, mm | NEES (3 is consistent) |", "|---|---|---|---|---|"]
    for name, case in CASES.items():
        if args.cases and not any(word in name for word in args.cases):
            continue
        found = []
        for seed in range(1, args.seeds + 1):
            with tempfile.TemporaryDirectory() as folder:
                errors, problems = run(args.program, pathlib.Path(folder), case, seed)
            found.append(errors)
            print(json.dumps({"case": name, "seed": seed, "rmse_m": errors.ate.rmse_m, "nees": errors.nees, "problems": problems}),
                  file=sys.stderr, flush=True)
        rmse = math.sqrt(np.mean([errors.ate.rmse_m ** 2 for errors in found]))
        lines.append(f"| {name} | {rmse:.4f} | {max(errors.ate.max_m for errors in found):.3f} | "
                     f"{1000 * np.median([errors.rpe_m for errors in found]):.1f} | {np.median([errors.nees for errors in found]):.1f} |")
    print("\n".join(lines))
    if args.write:
        table.replace_table(args.write, lines, BEGIN, END)


if __name__ == "__main__":
    main()
