#!/usr/bin/python3
"""Localises on two recordings of others and in simulation, and writes the tables of docs/results/localization.md.

usage: tools/localization_table.py PROGRAM DATA [--laps FOLDER] [--write docs/results/localization.md]

DATA holds lcm/ (an MBot driving three times round a taped rectangle) and aer1513/ (University of Toronto). Without --write the
table is printed. Simulated laps take minutes (images are rendered); --laps keeps them, and uses those that are there.
"""
import argparse
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

LAP_1_S = 60  # the first of three laps: what the calibration may see
TAPE = "x_m,y_m\n0,0\n1.32,0\n1.32,1.04\n0,1.04\n"
MBOT = "--tag-sigma-m 0.01 --point-sigma-m 0.01 --mounting-sigma-m 0.005 --mounting-sigma-rad 0.005".split()
AER = ("--range-sigma-m 0.02 --bearing-sigma-rad 0.015 --tag-sigma-m 0.02 --mounting-sigma-rad 0.02 --camera-latency-s 0.05 --along-m-sqrt-m 0.04 "
       "--across-m-sqrt-m 0.04 --yaw-rad-sqrt-m 0.03 --yaw-rad-sqrt-rad 0.05 --yaw-rad-sqrt-s 0.02 --drift-m-sqrt-s 0.005 "
       "--certain-sigma-m 10").split()
# Their map is the simulation's own, and so is where the camera sits: nothing is wrong with either.
EXACT = "--tag-sigma-m 0 --tag-sigma-rad 0 --mounting-sigma-m 0 --mounting-sigma-rad 0".split()
IMAGES, HOUSES = range(1, 5), range(1, 13)  # seeds
BEGIN, END = "<!-- localization table -->\n", "<!-- end of localization table -->\n"


def run(program, folder, *words):
    done = subprocess.run([program, *map(str, words), "--json"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"waymark {' '.join(map(str, words))}:\n{done.stderr}")
    return json.loads(done.stdout), done.stderr


def metres(value):
    return "-" if value is None else f"{value:.4f}"


def mbot(program, folder, data):
    log, landmarks = data / "lcm/lcmlog-2024-04-15.00", data / "lcm/landmarks.csv"
    (folder / "tape.csv").write_text(TAPE)
    run(program, folder, "calibrate", "robot", log, "--map", landmarks, "--to", LAP_1_S, "-o", "calibration.yaml", *MBOT)
    rows = []
    for name, flags in (("riekf, not calibrated", []), ("riekf, calibrated on lap 1", ["--calibration", "calibration.yaml"])):
        output = f"mbot{len(rows)}.mcap"
        report, words = run(program, folder, "localize", log, "--map", landmarks, "-o", output, *flags, *MBOT)
        judge = ["evaluate", output, "tape.csv", "--closed", "--odometry", log]
        later, _ = run(program, folder, *judge, "--from", LAP_1_S)
        first, _ = run(program, folder, *judge, "--to", LAP_1_S)
        rows.append((name, later, first, report))
    subprocess.run([program, "evaluate", output, "tape.csv", "--closed", "--odometry", log, "--from", str(LAP_1_S), "--figures", "mbot"],
                   cwd=folder, check=True, capture_output=True)
    last_later, last_first = rows[-1][1], rows[-1][2]
    lines = ["| MBot, from the tape, m | laps 2 and 3, RMS | worst | lap 1, signed, RMS |", "|---|---|---|---|"]
    for beside in last_later["beside"]:
        lap1 = next(row for row in last_first["beside"] if row["name"] == beside["name"])
        lines.append(f"| {beside['name']} | {metres(beside['path_rmse_m'])} | {metres(beside['path_max_m'])} | {metres(lap1['side_rmse_m'])} |")
    for name, later, first, _ in rows:
        lines.append(f"| {name} | {metres(later['path_rmse_m'])} | {metres(later['path_max_m'])} | {metres(first['side_rmse_m'])} |")
    warnings = [line.split(": ", 1)[1] for line in words.splitlines() if "swapped" in line]
    return lines + ["", f"Warnings about the map: {'; '.join(warnings) or 'nothing'}."]


def aer1513(program, folder, data):
    where = data / "aer1513"
    lines = ["| AER1513 | position RMSE, m | worst, m | yaw RMSE, deg | NEES (3) | NIS (1) | smoother, m | odometry alone, m |",
             "|---|---|---|---|---|---|---|---|"]
    for farthest, left_m, words in ((5, 0, ""), (3, 0, ""), (1, 0, ""), (5, -0.014, ", laser 14 mm to the right")):
        output = f"aer{farthest}{left_m}.mcap"
        localize = ["localize", where / "measurements.csv.gz", where / "odometry.csv.gz", "--map", where / "landmarks.csv",
                    "--farthest-m", farthest, "--sensor-pose", 0.219016, left_m, 0, *AER]
        run(program, folder, *localize, "-o", output)
        run(program, folder, *localize, "--method", "smoother", "-o", "smooth-" + output)
        scores, _ = run(program, folder, "evaluate", output, where / "truth.csv.gz", "--odometry", where / "odometry.csv.gz",
                        *(["--figures", "aer1513"] if len(lines) == 2 else []))
        smoothed, _ = run(program, folder, "evaluate", "smooth-" + output, where / "truth.csv.gz")
        lines.append(f"| landmarks within {farthest} m{words} | {metres(scores['ate_rmse_m'])} | {metres(scores['ate_max_m'])} | "
                     f"{scores['heading_rmse_deg']:.2f} | {scores['nees_mean']:.2f} | {scores['nis_mean']:.2f} | "
                     f"{metres(smoothed['ate_rmse_m'])} | {metres(scores['beside'][0]['ate_rmse_m'])} |")
    return lines


def taught(program, laps, name, *flags):
    lap = laps / name
    if not lap.exists():
        subprocess.run([program, "teach", *flags, "-o", str(lap)], check=True, capture_output=True)
    return lap


def judged(program, folder, lap, where, method, *flags):
    """Scores of one method on one lap."""
    output = f"{lap.stem}-{method}.mcap"
    (folder / output).unlink(missing_ok=True)
    run(program, folder, "localize", lap, "--map", where, "--method", method, "-o", output, *flags)
    return run(program, folder, "evaluate", output, lap)[0]


def number(value):
    return "-" if value is None else f"{value:.2f}"


def images(program, folder, laps):
    """Rendered images of circuit24, and the map that is made of the same lap."""
    lines = ["| circuit24, rendered images, map of the same lap | position RMSE, m | worst, m | NEES (3) | NIS (1) | anchor, m |",
             "|---|---|---|---|---|---|"]
    rows = []
    for seed in IMAGES:
        lap = taught(program, laps, f"lap{seed}.mcap", "--world", "circuit24", "--images", "--seed", str(seed))
        done = subprocess.run([program, "map", str(lap), "-o", f"map{seed}"], cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(done.stderr)
        scores = judged(program, folder, lap, f"map{seed}", "riekf")
        anchor = judged(program, folder, lap, f"map{seed}", "anchor")
        rows.append((scores, anchor))
        lines.append(f"| seed {seed} | {metres(scores['ate_rmse_m'])} | {metres(scores['ate_max_m'])} | {number(scores['nees_mean'])} | "
                     f"{number(scores['nis_mean'])} | {metres(anchor['ate_rmse_m'])} |")
    scores, anchors = zip(*rows)
    return lines + [f"| all | {metres(rms(scores))} | {metres(max(s['ate_max_m'] for s in scores))} | {number(mean(scores, 'nees_mean'))} | "
                    f"{number(mean(scores, 'nis_mean'))} | {metres(rms(anchors))} |"]


def map_of_world(world):
    """Writes a map.yaml with the tags of a world file."""
    size = re.search(r"^tag_size_m: (\S+)", world, re.M).group(1)
    text = 'format: waymark-map-1\nanchor: "tag36h11:5"\ntags:\n'
    for tag in re.finditer(r"id: (\d+), x_m: (\S+), y_m: (\S+), z_m: (\S+), facing_deg: ([-\d.]+)", world):
        into = (float(tag[5]) + 180) * math.pi / 360  # half the direction of its z axis
        c, s = math.cos(into) / 2, math.sin(into) / 2
        text += (f'  - tag: "tag36h11:{tag[1]}"\n    size_m: {size}\n    position_m: [{tag[2]}, {tag[3]}, {tag[4]}]\n'
                 f"    quaternion_xyzw: [{-c - s}, {c - s}, {-c + s}, {c + s}]\n    observations: 1\n")
    return text


def academy(program, folder, laps):
    """The exercise: its tags, its odometry."""
    world = pathlib.Path(__file__).resolve().parents[1] / "share/worlds/academy-house.yaml"
    (folder / "academy.yaml").write_text(map_of_world(world.read_text(encoding="utf-8")))
    lines = ["| academy-house, tags as the exercise gives them | riekf, m | NEES (3) | NIS (1) | smoother, m | NEES (3) | article, m | anchor, m | odometry, m | "
             "article / riekf | anchor / riekf | anchor / smoother |", "|---|---|---|---|---|---|---|---|---|---|---|---|"]
    rows = []
    for seed in HOUSES:
        lap = taught(program, laps, f"house{seed}.mcap", "--world", "academy-house", "--robot-file", "turtlebot3-waffle", "--seed", str(seed))
        flags = ["--robot", "turtlebot3-waffle"]
        scores = [judged(program, folder, lap, "academy.yaml", method, *flags, *(EXACT if method != "anchor" else []))
                  for method in ("riekf", "smoother", "anchor")]
        scores.insert(2, judged(program, folder, lap, "academy.yaml", "anchor", *flags, "--plain"))
        beside, _ = run(program, folder, "evaluate", f"{lap.stem}-riekf.mcap", lap, "--odometry", lap)
        rows.append((*scores, beside["beside"][0]))
        lines.append(house_row(f"seed {seed}", *([row] for row in rows[-1])))
    return lines + [house_row("all", *zip(*rows))]


def house_in_images(program, folder, laps):
    """The exercise as its robot sees it: rendered images. The article takes the width of the image for the focal length, as the
    exercise's text does."""
    root = pathlib.Path(__file__).resolve().parents[1]
    robot = (root / "share/robots/turtlebot3-waffle.yaml").read_text(encoding="utf-8")
    (folder / "article.yaml").write_text(robot.replace("1696.8", "1920.0"))
    lines = ["| academy-house, rendered images | riekf, m | NEES (3) | NIS (1) | article, m | article, with the true focal length, m | "
             "anchor, m | article / riekf | with the true focal length |", "|---|---|---|---|---|---|---|---|---|"]
    rows = []
    for seed in IMAGES:
        lap = taught(program, laps, f"house-images{seed}.mcap", "--world", "academy-house", "--robot-file", "turtlebot3-waffle", "--seed",
                     str(seed), "--images")
        known = ["--robot", "turtlebot3-waffle"]
        rows.append((judged(program, folder, lap, "academy.yaml", "riekf", *known, *EXACT),
                     judged(program, folder, lap, "academy.yaml", "anchor", "--robot", "article.yaml", "--plain"),
                     judged(program, folder, lap, "academy.yaml", "anchor", *known, "--plain"),
                     judged(program, folder, lap, "academy.yaml", "anchor", *known)))
        lines.append(images_row(f"seed {seed}", *([row] for row in rows[-1])))
    return lines + [images_row("all", *zip(*rows))]


def images_row(name, riekf, article, with_camera, anchor):
    return (f"| {name} | {metres(rms(riekf))} | {number(mean(riekf, 'nees_mean'))} | {number(mean(riekf, 'nis_mean'))} | {metres(rms(article))} | "
            f"{metres(rms(with_camera))} | {metres(rms(anchor))} | {rms(article) / rms(riekf):.1f} | {rms(with_camera) / rms(riekf):.1f} |")


def house_row(name, riekf, smoother, article, anchor, odometry):
    return (f"| {name} | {metres(rms(riekf))} | {number(mean(riekf, 'nees_mean'))} | {number(mean(riekf, 'nis_mean'))} | {metres(rms(smoother))} | "
            f"{number(mean(smoother, 'nees_mean'))} | {metres(rms(article))} | {metres(rms(anchor))} | {metres(rms(odometry))} | {rms(article) / rms(riekf):.1f} | {rms(anchor) / rms(riekf):.1f} | "
            f"{rms(anchor) / rms(smoother):.1f} |")


def rms(scores):
    """Of the errors of several drives, as if they were one."""
    return math.sqrt(sum(s["ate_rmse_m"] ** 2 for s in scores) / len(scores))


def mean(scores, key):
    return sum(s[key] for s in scores) / len(scores)


def geometric(program):
    """Fifty robots each, and the lower bound: runs the tests next to the program."""
    tests = pathlib.Path(program).parents[1] / "tests/waymark_localization_tests"
    done = subprocess.run([tests, "--gtest_filter=LocalizationInSimulation.*"], env={**os.environ, "WAYMARK_FULL": "1"}, capture_output=True,
                          text=True, check=False)
    lines = ["| 50 robots each | rmse, mm | posterior bound, mm | rmse / bound | NEES (3) | moments inside 95 % | NIS (1) | half seconds inside 95 % |",
             "|---|---|---|---|---|---|---|---|"]
    for row in re.finditer(r"^figures: (.*)$", done.stdout, re.M):
        lines.append(f"| {row[1]} |")
    if done.returncode != 0 or len(lines) < 3:
        sys.exit(f"{tests}:\n{done.stdout}{done.stderr}")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--laps", type=pathlib.Path)
    parser.add_argument("--write", type=pathlib.Path)
    args = parser.parse_args()
    program, data = str(pathlib.Path(args.program).resolve()), args.data.resolve()
    with tempfile.TemporaryDirectory(prefix="waymark-localization-") as name:
        folder = pathlib.Path(name)
        laps = args.laps.resolve() if args.laps else folder
        laps.mkdir(parents=True, exist_ok=True)
        parts = (mbot(program, folder, data), aer1513(program, folder, data), images(program, folder, laps),
                 academy(program, folder, laps), house_in_images(program, folder, laps), geometric(program))
        table = "\n\n".join("\n".join(part) for part in parts) + "\n"
        if args.write is not None:
            for name in ("mbot", "aer1513"):
                shutil.copy(folder / name / "trajectories.png", args.write.resolve().parent / f"images/{name}.png")
    if args.write is None:
        print(table, end="")
        return
    before, rest = args.write.read_text(encoding="utf-8").split(BEGIN)
    args.write.write_text(before + BEGIN + table + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
