#!/usr/bin/env python3
"""Writes the tables of docs/results/detection.md from the measurements of benchmarks/detector_table.cpp.

usage: tools/detector_table.py PROGRAM [--data DATA] [--tag-free FOLDER] [--results FILE] [--write docs/results/detection.md]

PROGRAM is the built benchmark detector_table; DATA contains synth-tags/clean and photonvision; FOLDER contains photographs without tags,
over which tags are rendered. It takes minutes. --results stores its output, or reads it if the file exists. Without --write the tables
are printed.
"""
import argparse
import json
import pathlib
import subprocess
import sys

BEGIN, END = "<!-- detector table -->\n", "<!-- end of detector table -->\n"
BASE = "AprilTag 3.3.0, decimate 1"
TIMED = ("mixed", "tag free", "photographs 1280x720", "tags on photographs")
SEEDS = (20261123, 7)  # tuned on the first, never on the second


def lines_of(words, seed):
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return [json.dumps({**json.loads(line), "seed": seed}) for line in done.stdout.splitlines()]


def measured(program, data, tag_free, results):
    if results and results.exists():
        return [json.loads(line) for line in results.read_text().splitlines()]
    lines = []
    for seed in SEEDS:
        words = [program, "--seed", str(seed)]
        if seed == SEEDS[0]:
            words += ["--data", data] if data else []
        else:
            words += ["--sets", "mixed,single"]
        lines += lines_of(words, seed)
    if tag_free:
        lines += lines_of([program, "--tag-free", tag_free, "--sets", "tags on photographs"], SEEDS[0])
    if results:
        results.write_text("\n".join(lines) + "\n")
    return [json.loads(line) for line in lines]


def in_order(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def recall_table(rows):
    """Fraction of the tags that were detected, and below it the number of false positives."""
    rows = [row for row in rows if row["tags"]]
    columns = list(dict.fromkeys((row["set"], row["seed"]) for row in rows))
    named = [name + ("" if seed == SEEDS[0] else f", seed {seed}") for name, seed in columns]
    lines = ["| found, % (wrong, number) | " + " | ".join(named) + " |", "|---" * (len(columns) + 1) + "|"]
    for detector in in_order(rows, "detector"):
        cells = []
        for name, seed in columns:
            found = [row for row in rows if (row["set"], row["seed"], row["detector"]) == (name, seed, detector)]
            if not found:
                cells.append("-")
                continue
            row = found[0]
            wrong = row["wrong_ids"] + row["false_positives"]
            cells.append(f"{100 * row['correct'] / row['tags']:.1f}" + (f" ({wrong})" if wrong else ""))
        lines.append(f"| {detector} | " + " | ".join(cells) + " |")
    return lines


def time_table(rows):
    rows = [row for row in rows if row["seed"] == SEEDS[0] and row["set"] in TIMED]
    columns = in_order(rows, "set")
    lines = ["| CPU time, ms: median, 90th percentile (share of AprilTag 3's) | " + " | ".join(columns) + " |",
             "|---" * (len(columns) + 1) + "|"]
    for detector in in_order(rows, "detector"):
        cells = []
        for name in columns:
            base = next(row for row in rows if row["set"] == name and row["detector"] == BASE)
            row = next((row for row in rows if row["set"] == name and row["detector"] == detector), None)
            cells.append("-" if row is None else f"{row['ms_median']:.2f}, {row['ms_p90']:.2f} (1/{base['ms_median'] / row['ms_median']:.1f})")
        lines.append(f"| {detector} | " + " | ".join(cells) + " |")
    return lines


def classes_table(rows, detector):
    """Tags detected in each class of size and tilt of the clean set, minus those of AprilTag 3."""
    clean = {row["detector"]: row for row in rows if "classes" in row}
    if detector not in clean or BASE not in clean:
        return []
    sizes = "to 11|11|13|15|18|22|28|40|70|140 px".split("|")
    tilts = "0|10|25|40|55|65|72 deg".split("|")
    lines = ["| clean set, tags found: waymark minus AprilTag 3 (of total) | " + " | ".join("tilt from " + tilt for tilt in tilts) + " |",
             "|---" * (len(tilts) + 1) + "|"]
    for size, ours, theirs in zip(sizes, clean[detector]["classes"], clean[BASE]["classes"]):
        if any(of for _, of in ours):
            cells = [f"{a - b:+d} ({of})" if of else "-" for (a, of), (b, _) in zip(ours, theirs)]
            lines.append(f"| {size} | " + " | ".join(cells) + " |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--data")
    parser.add_argument("--tag-free")
    parser.add_argument("--results", type=pathlib.Path)
    parser.add_argument("--write", type=pathlib.Path)
    flags = parser.parse_args()
    rows = measured(flags.program, flags.data, flags.tag_free, flags.results)
    tables = [recall_table(rows), time_table(rows), classes_table(rows, "waymark")]
    text = "\n".join("\n".join(table) + "\n" for table in tables if table)
    if not flags.write:
        print(text)
        return
    page = flags.write.read_text()
    if BEGIN not in page or END not in page:
        sys.exit(f"{flags.write} has no line {BEGIN.strip()}")
    head, rest = page.split(BEGIN)
    flags.write.write_text(head + BEGIN + text + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
