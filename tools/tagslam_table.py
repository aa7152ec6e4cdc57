#!/usr/bin/env python3
"""Maps TagSLAM's own tests (berndpfrommer/tagslam_test) with `waymark map --tagslam` and prints a comparison.

    tools/tagslam_table.py WAYMARK DATA [--tests 1,2,10] [--write docs/results/mapping.md]

WAYMARK is the program, DATA the folder with test_1, test_2, ... Each test is mapped twice: with our own model (time and
memory are of this run, from load to written map) and with --model tagslam on the frames TagSLAM kept, for which its
published solution is evaluated by the same program. Processor time is the lowest of three runs, because other programs
on the machine use its caches. --write writes the table between the markers in that file.
TagSLAM's times and memory were measured once, on one core of the same class of machine.
"""
import argparse
import csv
import gzip
import json
import math
import pathlib
import resource
import subprocess
import sys
import tempfile

# TagSLAM itself: seconds (about 2 of them are its start and a fixed wait), MB.
TAGSLAM = {1: (2.6, 99), 2: (8.2, 207), 3: (86.6, 236), 4: (2.5, 97), 6: (183, 2739), 7: (5.3, 164), 10: (12.8, 166),
           15: (2.7, 73), 16: (2.9, 113), 18: (3.9, 73), 21: (4.6, 165), 22: (2.3, 79), 24: (5.2, 112)}
TARGETS = (2, 3, 6, 7, 10, 24)  # of ten times less time, three times less memory
START, END = "<!-- tagslam table -->", "<!-- end of tagslam table -->"


def waymark(program, arguments):
    """The summary of one run with its processor time, which depends little on other programs (it has one thread)."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, "map", *map(str, arguments), "--json"], capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        return {"error": done.stderr.strip()}
    return {**json.loads(done.stdout), "cpu_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}


def unpacked_reference(test, folder):
    """The published solution as plain files."""
    target = pathlib.Path(folder) / "reference"
    target.mkdir()
    (target / "ref_static.csv").write_bytes((test / "ref_static.csv").read_bytes())
    (target / "ref_trajectory.csv").write_bytes(gzip.open(test / "ref_trajectory.csv.gz").read())
    return target


def rotated(q, v):
    w, x, y, z = q
    t = (2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0]))
    return [v[i] + w * t[i] + c for i, c in enumerate((y * t[2] - z * t[1], z * t[0] - x * t[2], x * t[1] - y * t[0]))]


def aligned_mean(pairs):
    """Mean distance after the best rigid motion (Horn, "Closed-form solution of absolute orientation using unit
    quaternions", 1987), the largest eigenvector by the power method."""
    n = len(pairs)
    mean = [[sum(p[s][i] for p in pairs) / n for i in range(3)] for s in (0, 1)]
    a = [[p[0][i] - mean[0][i] for i in range(3)] for p in pairs]
    b = [[p[1][i] - mean[1][i] for i in range(3)] for p in pairs]
    s = [[sum(x[i] * y[j] for x, y in zip(a, b)) for j in range(3)] for i in range(3)]
    m = [[s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
         [0, s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
         [0, 0, -s[0][0] + s[1][1] - s[2][2], s[1][2] + s[2][1]], [0, 0, 0, -s[0][0] - s[1][1] + s[2][2]]]
    shift = sum(abs(v) for row in s for v in row) * 2
    m = [[m[min(i, j)][max(i, j)] + (shift if i == j else 0) for j in range(4)] for i in range(4)]
    q = [1.0, 0.3, 0.2, 0.1]
    for _ in range(20000):
        q = [sum(m[i][j] * q[j] for j in range(4)) for i in range(4)]
        norm = math.sqrt(sum(x * x for x in q))
        q = [x / norm for x in q]
    return sum(math.dist(rotated(q, x), y) for x, y in zip(a, b)) / n


def tags_of_map(path):
    """Positions by id of a map.yaml."""
    tags, number = {}, None
    for line in path.read_text().splitlines():
        word = line.strip().lstrip("- ")
        if word.startswith("tag:"):
            number = int(word.split(":")[-1].strip().strip('"'))
        elif word.startswith("position_m:") and number is not None:
            tags[number] = [float(x) for x in word.split(":")[1].strip(" []").split(",")]
    return tags


def measured(test, ours):
    """Mean error in mm of the tags whose positions were measured by hand."""
    file = test / "measured_tags.csv"
    if not file.exists() or not ours.exists():
        return None
    truth = {int(r["tag"]): [float(r[k]) for k in "xyz"] for r in csv.DictReader(open(file))}
    tags = tags_of_map(ours)
    pairs = [(tags[t], truth[t]) for t in truth if t in tags]
    return 1000 * aligned_mean(pairs), len(pairs)


def row_of(number, program, data):
    test = data / f"test_{number}"
    bag = data / f"test_{2 if number == 3 else number}" / "tag_detections.bag.bz2"
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder)
        runs = [waymark(program, [bag, "--tagslam", test, "-o", out / "ours"]) for _ in range(3)]
        ours = min(runs, key=lambda run: run.get("cpu_s", math.inf))
        same = waymark(program, [bag, "--tagslam", test, "-o", out / "same", "--model", "tagslam", "--against",
                                 unpacked_reference(test, folder)])
        hand = measured(test, out / "ours" / "map.yaml")
    return ours, same, hand


def words_of(number, ours, same, hand):
    if "error" in ours or "error" in same:
        return f"| {number} | failed: {ours.get('error') or same.get('error')} |", False
    time_s, memory = TAGSLAM[number]
    faster = (time_s - 2) / ours["cpu_s"]
    smaller = memory / (ours["peak_rss_mib"] * 1.048576)
    ratio = same["cost"] / same["against"]["cost"]
    fine = ratio <= 1.01 and (number not in TARGETS or (faster >= 10 and smaller >= 3))
    left = len(ours["foreign_ids"]) + len(ours["rejected_tag_ids"])
    text = (f"| {number} | {ours['cpu_s']:.2f} | {faster:.1f} | {ours['peak_rss_mib'] * 1.048576:.0f} | {smaller:.1f} | "
            f"{same['cost']:.2f} | {same['against']['cost']:.2f} | {ratio:.4f} | "
            f"{ours['reprojection_mean_px']:.3f} / {ours['reprojection_median_px']:.3f} | {ours['noise_px']:.3f} | "
            f"{ours['tags']} | {ours['rejected_observations']} of {ours['observations']} | {left} |")
    if hand:
        text += f"\n|  | against {hand[1]} tags measured by hand, after rigid alignment: {hand[0]:.1f} mm mean |"
    return text, fine


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("waymark")
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--tests", default=",".join(map(str, TAGSLAM)))
    parser.add_argument("--write", type=pathlib.Path)
    args = parser.parse_args()
    lines = ["| test | CPU s | TagSLAM less 2 s / ours | MB | TagSLAM / ours | cost, model tagslam | TagSLAM's own | ratio | "
             "reprojection px, ours, mean / median | noise px | tags | observations rejected | ids rejected |",
             "|" + "---|" * 13]
    print(lines[0], lines[1], sep="\n")
    all_fine = True
    for number in map(int, args.tests.split(",")):
        text, fine = words_of(number, *row_of(number, args.waymark, args.data))
        all_fine = all_fine and fine
        lines.append(text)
        print(text, flush=True)
    if args.write:
        page = args.write.read_text()
        before, rest = page.split(START)
        after = rest.split(END)[1]
        args.write.write_text(before + START + "\n" + "\n".join(lines) + "\n" + END + after)
    return 0 if all_fine else 1


if __name__ == "__main__":
    sys.exit(main())
