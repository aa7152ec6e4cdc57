#!/usr/bin/python3
"""Teaches, maps and replays in simulation and writes the tables of docs/results/replay.md.

usage: tools/replay_table.py PROGRAM [--data DATA] [--seeds 5] [--laps 10] [--images-seeds 1] [--images-laps 1] [--images-fast-seeds 1]
       [--keep FOLDER] [--only circuit,images,recorded,faults] [--write docs/results/replay.md]

DATA contains paths/ (laps recorded with a LIMO: s, x, y, theta, kappa); without it their rows are omitted. --images-seeds 0 omits the
rows with rendered images, which take minutes per lap. With --keep every outcome is stored in FOLDER under a hash of the program, and an
interrupted run continues. Without --write the section is printed.
"""
import argparse
import csv
import hashlib
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- replay table -->\n", "<!-- end of replay table -->\n"
GAINS = (0.6, 0.7, 0.8, 0.9, 1.0)  # cyclic over the seeds: fraction of the commanded yaw rate
LATENCY_S = 0.08
ANOTHER_DAY = 1000  # added to the seed of the teach lap
RECORDED = ("ref_sim048", "ref_real047", "ref_real022")
MOST_CURVATURE = 2.5  # 1/m, of their lines
HEAD = ("| what | runs | completed | cross-track RMSE, cm: median / worst | P95, cm | largest, cm | heading RMSE, deg | stops |\n"
        "|---|---|---|---|---|---|---|---|")


class Bench:
    """Runs the program in a folder, which also stores the outcomes of replays."""
    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.kept = folder / "outcomes.json"
        self.outcomes = json.loads(self.kept.read_text()) if self.kept.exists() else {}

    def outcome(self, *words):
        key = " ".join(map(str, words)).replace(str(self.folder), ".")
        if key not in self.outcomes:
            self.outcomes[key] = self.run(*words)
            fresh = self.kept.with_suffix(".new")
            fresh.write_text(json.dumps(self.outcomes, indent=1))
            fresh.replace(self.kept)
        return self.outcomes[key]

    def run(self, *words):
        done = subprocess.run([self.program, *map(str, words), "--json"], cwd=self.folder, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1) or not done.stdout.strip():
            sys.exit(f"waymark {' '.join(map(str, words))}:\n{done.stderr}")
        return json.loads(done.stdout.splitlines()[-1])

    def robot(self, gain):
        path = self.folder / f"robot-{gain:.1f}.yaml"
        path.write_text((ROOT / "share/robots/limo.yaml").read_text() +
                        f"simulation:\n  camera_latency_s: {LATENCY_S}\n  dynamics: {{turn_gain: {gain}}}\n")
        return path

    def lap(self, name, world, seed, *flags, speed=0.3, closed=True):
        """A taught and mapped lap: the folder of the map."""
        folder = self.folder / f"{name}-{seed}"
        if not (folder / "summary.json").exists():
            (self.folder / f"{name}-{seed}.mcap").unlink(missing_ok=True)  # of an interrupted run
            self.run("teach", "--world", world, "--robot-file", self.robot(GAINS[(seed - 1) % len(GAINS)]), "--seed", seed,
                     "--speed-m-s", speed, "-o", f"{name}-{seed}.mcap", *flags)
            self.run("map", f"{name}-{seed}.mcap", "-o", folder, *([] if closed else ["--closing-distance-m", 0]))
        return folder

    def replay(self, folder, world, seed, *flags):
        return self.outcome("replay", folder, "--world", world, "--robot-file", self.robot(GAINS[(seed - 1) % len(GAINS)]), "--seed",
                        seed + ANOTHER_DAY, *flags)


def row(what, outcomes):
    def both(key, factor):
        values = [o[key] * factor for o in outcomes if o[key] is not None]
        return f"{statistics.median(values):.2f} / {max(values):.2f}" if values else "-"
    finished = sum(o["finished"] for o in outcomes)
    return (f"| {what} | {len(outcomes)} | {finished} | {both('cross_track_rmse_m', 100)} | {both('cross_track_p95_m', 100)} | "
            f"{both('cross_track_max_m', 100)} | {both('heading_rmse_deg', 1)} | {sum(o['stops'] for o in outcomes)} |")


def circuit(bench, args):
    lines = []
    for speed in (0.4, 0.8):
        for controller in ("follower", "pursuit", "pose"):
            if controller == "pose" and speed > 0.5:
                continue  # its speed is its gain's
            outcomes = []
            for seed in range(1, args.seeds + 1):
                folder = bench.lap("circuit", "circuit24", seed)
                outcomes.append(bench.replay(folder, "circuit24", seed, "--controller", controller, "--laps", args.laps, "--speed-m-s", speed,
                                             "--max-speed-m-s", 1, "--max-yaw-rate-rad-s", 2))
            lines.append(row(f"circuit24, {controller}, {speed} m/s, {args.laps} laps", outcomes))
    return lines


def images(bench, args):
    lines = []
    fast = ["--max-speed-m-s", 1, "--max-yaw-rate-rad-s", 2]
    cases = [("", 0.4, args.images_laps, args.images_seeds, []),
             ("", 0.8, 1, min(args.images_seeds, args.images_fast_seeds), fast),
             (", light halved", 0.4, 1, min(args.images_seeds, args.images_fast_seeds), ["--set", "camera.white_level_dn=95"])]
    for words, speed, laps, seeds, flags in cases:
        outcomes = []
        for seed in range(1, seeds + 1):
            folder = bench.lap("images", "circuit24", seed, "--images")
            outcomes.append(bench.replay(folder, "circuit24", seed, "--images", "--laps", laps, "--speed-m-s", speed, *flags))
        lines.append(row(f"circuit24, follower, {speed} m/s, {laps} {'lap' if laps == 1 else 'laps'}, rendered images{words}", outcomes))
    return lines


def drivable(rows):
    """The points of a line s, x, y, theta, kappa; a bend that is too tight turns by the same angle on a wider arc."""
    x, y = float(rows[0][1]), float(rows[0][2])
    points = [(x, y)]
    for a, b in zip(rows, rows[1:]):
        way = (float(b[0]) - float(a[0])) * max(1.0, abs(float(a[4])) / MOST_CURVATURE)
        x, y = x + way * math.cos(float(a[3])), y + way * math.sin(float(a[3]))
        points.append((x, y))
    for _ in range(20):  # smooths the noise of single points
        points = [points[0]] + [tuple((p[k] + 2 * q[k] + r[k]) / 4 for k in (0, 1)) for p, q, r in
                                zip(points, points[1:], points[2:])] + [points[-1]]
    return points


def lay_tags(points, file, closed):
    """A world with the line and a ring of tags one metre outside of it, facing inwards."""
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    middle = ((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2)
    half = ((max(xs) - min(xs)) / 2 + 1, (max(ys) - min(ys)) / 2 + 1)
    count = max(16, round(math.pi * sum(half) / 0.5))
    tags = []
    for i in range(count):
        angle = 2 * math.pi * i / count
        x, y = middle[0] + half[0] * math.cos(angle), middle[1] + half[1] * math.sin(angle)
        facing = math.degrees(math.atan2(middle[1] - y, middle[0] - x))
        tags.append((x, y, facing))
    heading = math.atan2(points[5][1] - points[0][1], points[5][0] - points[0][0])

    def ahead(tag):  # angle between the initial heading and the direction to the tag
        way = math.atan2(tag[1] - points[0][1], tag[0] - points[0][0])
        return abs(math.remainder(way - heading, 2 * math.pi))
    anchor = min(range(count), key=lambda i: ahead(tags[i]))
    text = f"name: {file.stem}\ntag_family: tag36h11\ntag_size_m: 0.16\nanchor_id: {anchor}\ntags:\n"
    text += "".join(f"  - {{id: {i}, x_m: {x:.3f}, y_m: {y:.3f}, z_m: 0.3, facing_deg: {f:.1f}}}\n" for i, (x, y, f) in enumerate(tags))
    text += f"path_closed: {'true' if closed else 'false'}\npath_m:\n"
    line = points[::5] if closed or (len(points) - 1) % 5 == 0 else points[::5] + points[-1:]
    file.write_text(text + "".join(f"  - [{x:.4f}, {y:.4f}]\n" for x, y in line))


def recorded(bench, args):
    lines = []
    for name in RECORDED:
        with open(pathlib.Path(args.data) / "paths" / f"{name}.csv", encoding="utf-8") as file:
            rows = list(csv.reader(line for line in file if not line.startswith("#")))
        points = drivable(rows)
        world = bench.folder / f"{name}.yaml"
        lay_tags(points, world, closed=False)
        for controller in ("follower", "pursuit", "pose"):
            outcomes = []
            for seed in range(1, args.seeds + 1):
                folder = bench.lap(name, world, seed, speed=0.25, closed=False)
                outcomes.append(bench.replay(folder, world, seed, "--controller", controller, "--speed-m-s", 0.25))
            lines.append(row(f"{name}, {controller}, 0.25 m/s", outcomes))
    return lines


FAULTS = {
    "dark camera for 5 s": "{fault: camera_blackout, at_s: 15, for_s: 5}",
    "3 of 24 tags removed": "{fault: tag_removed, id: 3}, {fault: tag_removed, id: 9}, {fault: tag_removed, id: 17}",
    "wheels slip for 0.5 s": "{fault: slip_burst, at_s: 15, for_s: 0.5, speed_share: 0.3, yaw_share: 1}",
    "a tag moved by 20 cm": "{fault: tag_moved, id: 9, x_m: 0.14, y_m: 0.14, z_m: 0, turn_deg: 0}",
    "odometry lost": "{fault: odometry_lost, at_s: 15}",
    "carried 1 m ahead": "{fault: kidnapped, at_s: 15, forward_m: 1, left_m: 0, turn_deg: 0}",
    "clock jumps by 0.5 s": "{fault: clock_jump, at_s: 15, jump_s: 0.5}",
}


def faults(bench, args):
    lines = ["", "| fault | completed | largest cross-track, cm: median / worst | last message, 5 s after it stopped |", "|---|---|---|---|"]
    for name, script in FAULTS.items():
        file = bench.folder / f"{name.replace(' ', '-')}.yaml"
        file.write_text(f"faults: [{script}]\n")
        outcomes = [bench.replay(bench.lap("circuit", "circuit24", seed), "circuit24", seed, "--speed-m-s", 0.4, "--faults", file)
                    for seed in range(1, args.seeds + 1)]
        done = [o for o in outcomes if o["finished"]]
        words = sorted({o["reason"].split(":")[0] for o in outcomes if not o["finished"]})
        worst = [100 * o["cross_track_max_m"] for o in done]
        figures = f"{statistics.median(worst):.2f} / {max(worst):.2f}" if worst else "-"
        lines.append(f"| {name} | {len(done)} of {len(outcomes)} | {figures} | {'; '.join(words[:2]) or '-'} |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--data")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--laps", type=int, default=10)
    parser.add_argument("--images-seeds", type=int, default=1)
    parser.add_argument("--images-laps", type=int, default=1)
    parser.add_argument("--images-fast-seeds", type=int, default=1)
    parser.add_argument("--keep")
    parser.add_argument("--only", default="circuit,images,recorded,faults")
    parser.add_argument("--write")
    args = parser.parse_args()
    if args.data:
        args.data = str(pathlib.Path(args.data).resolve())
    parts = {"circuit": circuit, "images": images if args.images_seeds > 0 else None, "recorded": recorded if args.data else None,
             "faults": faults}
    if args.write and set(args.only.split(",")) != set(parts):
        sys.exit("--only and --write: the page holds all parts")
    with tempfile.TemporaryDirectory(prefix="waymark-replay-") as name:
        folder = pathlib.Path(name)
        if args.keep:
            folder = pathlib.Path(args.keep).resolve() / hashlib.sha256(pathlib.Path(args.program).read_bytes()).hexdigest()[:12]
            folder.mkdir(parents=True, exist_ok=True)
        bench = Bench(str(pathlib.Path(args.program).resolve()), folder)
        lines = [HEAD]
        for part in args.only.split(","):
            if parts[part]:
                lines += parts[part](bench, args)
        text = "\n".join(lines) + "\n"
    if not args.write:
        print(text, end="")
        return
    page = pathlib.Path(args.write)
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(before + BEGIN + text + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
