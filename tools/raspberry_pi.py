#!/usr/bin/env python3
"""Estimates the camera rate that a processor like that of a Raspberry Pi 4 can process, from counted instructions: docs/results/raspberry_pi.md.

usage: tools/raspberry_pi.py PROGRAM [--laps SHARE] [--write]
  PROGRAM    a waymark without kernels for AVX2: cmake --preset package -DWAYMARK_AVX2=OFF
  --laps     fraction of a simulated lap, with rendered images of 640 x 480, that is counted with callgrind (valgrind); default 0.1
  --write    writes the table into docs/results/raspberry_pi.md

This is an estimate, not a measurement: instructions of the portable build on x86-64, times an assumed range of cycles per instruction, at an
assumed clock rate.
"""
import argparse
import datetime
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/results/raspberry_pi.md"
BEGIN, END = "<!-- table: tools/raspberry_pi.py -->\n", "<!-- end of the table -->"
CLOCK_GHZ = 1.5
CYCLES_AN_INSTRUCTION = (0.7, 1.5)
# From the grey image to the command: prefixes of the names of functions that are called from outside.
IMAGE, FRAME = "waymark::find_tags(", "waymark::Replayer::add(waymark::TagFrame"
DETECTION = ("waymark::(anonymous namespace)::WaymarkDetector::detect(waymark::ImageView const&) const",
             "waymark::(anonymous namespace)::AprilTagDetector::detect(waymark::ImageView const&) const")
REFINEMENT, LOCALISATION, STEP = ("waymark::refine_corners(",), ("waymark::Replayer::add(",), ("waymark::Replayer::step(",)


def inclusive_costs(path):
    """{function: (calls, instructions with all they call)} of a callgrind file; a function that calls itself counts once."""
    names, costs = {}, {}
    caller = callee = None

    def named(text):
        number, _, name = text.partition(" ")
        if name:
            names[number] = name
        return names[number]

    lines = iter(pathlib.Path(path).read_text(errors="replace").splitlines())
    for line in lines:
        if line.startswith("fn="):
            caller = named(line[3:])
        elif line.startswith("cfn="):
            callee = named(line[4:])
        elif line.startswith("calls="):
            calls, cost = int(line[6:].split()[0]), int(next(lines).split()[1])
            if caller != callee:
                known = costs.get(callee, (0, 0))
                costs[callee] = (known[0] + calls, known[1] + cost)
    return costs


def of(costs, prefixes):
    """(calls, instructions) of all functions with these prefixes."""
    found = [cost for name, cost in costs.items() if name.startswith(tuple(prefixes))]
    return sum(calls for calls, _ in found), sum(cost for _, cost in found)


def under_callgrind(folder, *command):
    """The costs of a program's run."""
    out = folder / "counted"
    subprocess.run(["valgrind", "--tool=callgrind", "--compress-pos=no", f"--callgrind-out-file={out}", *map(str, command)], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return inclusive_costs(out)


def an_image(costs, unit, stages):
    """Millions of instructions of each stage per call of `unit`, and the number of its calls."""
    count = of(costs, [unit])[0]
    if not count:
        raise SystemExit(f"{unit} was not called")
    return [of(costs, stage)[1] / count / 1e6 for stage in stages], count


def row(detector, seen, count, driven):
    stages = [*seen, *driven]
    total = sum(stages)
    ms = [total * cycles / CLOCK_GHZ for cycles in CYCLES_AN_INSTRUCTION]  # millions over 10^9 a second
    numbers = " | ".join(f"{value:.2f}" for value in stages)
    return f"| {detector} | {count} | {numbers} | {total:.1f} | {ms[0]:.1f} to {ms[1]:.1f} | {1e3 / ms[1]:.0f} to {1e3 / ms[0]:.0f} |\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--laps", type=float, default=0.1)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    table = "| detector | images | detection, M | refinement, M | localisation, M | replay steps, M | total, M | ms per image | largest rate, Hz |\n"
    table += "|---" * 9 + "|\n"
    with tempfile.TemporaryDirectory(prefix="waymark-budget-") as name:
        folder = pathlib.Path(name)
        subprocess.run([given.program, "demo", "-o", folder / "demo", "--seed", "7"], check=True, capture_output=True)
        place = next(path.parent for path in (folder / "demo").rglob("map.yaml"))
        replay = ["replay", place, "--robot", "sim", "--world", "circuit24", "--seed", "7", "--laps", given.laps]
        subprocess.run([given.program, *map(str, replay), "--images", "--record-images", "raw", "-o", folder / "lap.mcap"], check=True, capture_output=True)
        driven, _ = an_image(under_callgrind(folder, given.program, *replay), FRAME, (LOCALISATION, STEP))
        for detector in ("waymark", "apriltag3"):
            costs = under_callgrind(folder, given.program, "detect", folder / "lap.mcap", "--set", f"detector.detector={detector}")
            table += row(detector, *an_image(costs, IMAGE, (DETECTION, REFINEMENT)), driven)
    print(table, end="")
    if given.write:
        text = PAGE.read_text()
        dated = f"{datetime.date.today():%d %B %Y}:\n\n" + table
        PAGE.write_text(re.sub(re.escape(BEGIN) + ".*?" + re.escape(END), lambda _: BEGIN + dated + END, text, flags=re.S))
    return 0


if __name__ == "__main__":
    sys.exit(main())
