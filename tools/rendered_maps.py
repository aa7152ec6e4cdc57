#!/usr/bin/python3
"""Maps simulated laps with rendered images and compares the tags with the world: error, bias and consistency over seeds.

usage: tools/rendered_maps.py PROGRAM [--world circuit24] [--seeds 24] [--laps FOLDER] [--write docs/results/mapping.md]

A lap is taught with --images, its tags are detected in the images, and it is mapped by the bundle and by the chain. Nothing is
aligned: the anchor defines the frame of both maps and of the world. --laps keeps the recordings (4 MB each), and reuses existing
ones. Without --write the table is printed.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
import yaml

ROOT = pathlib.Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- rendered maps table -->\n", "<!-- end of rendered maps table -->\n"


def run(program, *words):
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"waymark {' '.join(map(str, words))}:\n{done.stderr}")
    return done.stdout


def true_positions(world):
    content = yaml.safe_load((ROOT / f"share/worlds/{world}.yaml").read_text())
    return {tag["id"]: np.array([tag["x_m"], tag["y_m"], tag["z_m"]]) for tag in content["tags"]}


def position_covariance(tag):
    """Covariance of the position in the map, from that of the pose in its left tangent (translation, rotation)."""
    pose = np.zeros((6, 6))
    pose[np.triu_indices(6)] = tag["covariance"]
    pose += np.triu(pose, 1).T
    x, y, z = tag["position_m"]
    jacobian = np.hstack([np.eye(3), np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])])
    return jacobian @ pose @ jacobian.T


def errors(path, truth):
    """Position error and covariance of each tag except the anchor."""
    content = yaml.load((path / "map.yaml").read_text(), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    found = {}
    for tag in content["tags"]:
        if tag["tag"] == content["anchor"]:
            continue
        number = int(tag["tag"].split(":")[1])
        found[number] = np.array(tag["position_m"]) - truth[number], position_covariance(tag) if "covariance" in tag else None
    return found


def judge_seed(program, world, seed, laps, folder, truth):
    lap = laps / f"{world}-{seed}.mcap"
    if not lap.exists():
        run(program, "teach", "--world", world, "--images", "--seed", seed, "-o", lap)
    reports = {}
    for method in ("bundle", "chain"):
        out = folder / f"{method}{seed}"
        reports[method] = json.loads(run(program, "map", lap, "-o", out, "--method", method, "--json"))
    found = errors(folder / f"bundle{seed}", truth)
    chi2 = [float(off @ np.linalg.solve(P, off)) for off, P in found.values()]
    row = {"seed": seed, "bundle": reports["bundle"]["tag_rmse_m"], "chain": reports["chain"]["tag_rmse_m"],
           "way": reports["bundle"]["trajectory_rmse_m"], "chain_way": reports["chain"]["trajectory_rmse_m"],
           "ratio": reports["bundle"]["corner_noise_ratio"], "nees": float(np.mean(chi2)) / 3, "found": found}
    print(f"seed {seed}: tags {row['bundle']:.4f} m (chain {row['chain']:.4f}), way {row['way']:.4f} ({row['chain_way']:.4f}), "
          f"NEES/3 {row['nees']:.2f}, corner noise {row['ratio']:.2f}", file=sys.stderr, flush=True)
    return row


def bias(rows):
    """RMS over tags and coordinates of the mean error divided by its stated sigma, and the value expected without bias."""
    parts = []
    for number in rows[0]["found"]:
        seen = [row["found"][number] for row in rows if number in row["found"]]
        mean = np.mean([off for off, _ in seen], axis=0)
        parts += list(mean / np.sqrt(np.mean([np.diag(P) for _, P in seen], axis=0)))
    return float(np.sqrt(np.mean(np.square(parts)))), 1 / np.sqrt(len(rows))


def table(world, rows):
    better = sum(row["bundle"] < row["chain"] for row in rows)
    way = sum(row["way"] < row["chain_way"] for row in rows)
    part, chance = bias(rows)

    def rms(key):
        return np.sqrt(np.mean([row[key] ** 2 for row in rows]))

    return (f"| `{world}` | {len(rows)} | {rms('bundle'):.4f} / {max(r['bundle'] for r in rows):.4f} | {rms('chain'):.4f} / {max(r['chain'] for r in rows):.4f} "
            f"| {better} / {way} | {part:.2f} ({chance:.2f}) | {np.mean([r['nees'] for r in rows]):.2f} "
            f"({min(r['nees'] for r in rows):.2f} to {max(r['nees'] for r in rows):.2f}) | {np.mean([r['ratio'] for r in rows]):.2f} |\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--world", action="append")
    parser.add_argument("--seeds", type=int, default=24)
    parser.add_argument("--laps", type=pathlib.Path)
    parser.add_argument("--write", type=pathlib.Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="waymark-rendered-") as name:
        folder = pathlib.Path(name)
        laps = given.laps or folder
        laps.mkdir(parents=True, exist_ok=True)
        text = ("| world | laps | tags, bundle, RMSE / worst lap, m | tags, chain | laps in which the bundle's tags / trajectory are better | bias over sigma (by chance) "
                "| NEES/3 of tags, mean (of a lap) | corner noise over stated |\n|---|---|---|---|---|---|---|---|\n")
        for world in given.world or ["circuit24"]:
            truth = true_positions(world)
            text += table(world, [judge_seed(given.program, world, seed, laps, folder, truth) for seed in range(1, given.seeds + 1)])
    if not given.write:
        print(text, end="")
        return
    content = given.write.read_text()
    if BEGIN not in content:
        sys.exit(f"{given.write}: no line '{BEGIN.strip()}'")
    given.write.write_text(re.sub(re.escape(BEGIN) + ".*?" + re.escape(END), lambda _: BEGIN + text + END, content, flags=re.S))


if __name__ == "__main__":
    main()
