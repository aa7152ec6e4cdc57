#!/usr/bin/python3
"""Measures the page of `waymark view` on this machine for docs/results/page.md.

usage: measure_page.py PROGRAM BENCHMARKS_FOLDER [RUNS]     both of the release preset; needs what the tests of the page need (tests/viewer)
"""
import gzip
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TESTS = ROOT / "tests/viewer"
VIEWER = ROOT / "build/viewer"


def node_json(script, *words):
    """The output of a script in viewer/test."""
    node, environment = tools
    done = subprocess.run([node, ROOT / "viewer/test" / script, *map(str, words)], check=True, capture_output=True, text=True, env={**os.environ, **environment})
    return json.loads(done.stdout)


def line(name, values):
    ordered = sorted(values)
    print(f"{name:<72} median {statistics.median(ordered):8.1f}   95 % {ordered[int(len(ordered) * 0.95)]:8.1f}   most {ordered[-1]:8.1f}   of {len(ordered)}", flush=True)


def bundle():
    files = sorted((VIEWER / "dist").glob("*.gz"))
    packed = sum(file.stat().st_size for file in files)
    raw = sum(len(gzip.decompress(file.read_bytes())) for file in files)
    print(f"all files of the page: {raw / 1e3:.0f} kB, packed, as they are in the program: {packed / 1e3:.0f} kB", flush=True)


def recording(program, benchmarks, runs):
    with tempfile.TemporaryDirectory(prefix="waymark-page-") as folder:
        path = pathlib.Path(folder) / "long.mcap"
        subprocess.run([benchmarks / "long_recording", path, "600"], check=True)
        print(f"a recording of ten minutes, {path.stat().st_size / 1e6:.0f} MB", flush=True)
        measured = [node_json("scrub.mjs", program, path) for _ in range(runs)]
    for key, name in (("painted_ms", "first paint after the server's start [ms]"), ("usable_ms", "usable after the server's start [ms]"), ("read_ms", "all of it read [ms]")):
        line(name, [one[key] for one in measured])
    jumps = [ms for one in measured for ms in one["jumps_ms"]]
    line("a jump of the timeline to its image [ms]", jumps)
    print(f"jumps above 200 ms: {sum(ms > 200 for ms in jumps)} of {len(jumps)}", flush=True)


def ages(name, measured):
    line(f"{name}: until it is drawn [ms]", [ms for one in measured for ms in one["drawn_ms"]])
    line(f"{name}: until it is on the screen [ms]", [ms for one in measured for ms in one["painted_ms"]])
    print(f"images shown a second: {statistics.median(one['images_per_s'] for one in measured):.1f}, frames {statistics.median(one['frames_per_s'] for one in measured):.1f}", flush=True)


def quick_camera(program, benchmarks, world, lap, runs):
    """Plays the images of a recorded lap at 30 Hz, because two cores cannot also render a simulated world at this rate."""
    subprocess.run([program, "teach", "--world", world, "--images", "--record-images", "jpeg", "-o", lap], check=True, capture_output=True)
    measured = []
    for _ in range(runs):
        with subprocess.Popen([benchmarks / "live_images", lap, "30"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as camera:
            measured.append(node_json("age.mjs", camera.stdout.readline().strip(), 300))
            camera.stdin.close()
    ages("an image with its tags, 30 a second", measured)


def live(program, benchmarks, runs):
    from live_page_test import round_world
    from live_test import Robot  # reads the program from the command line
    measured = []
    with tempfile.TemporaryDirectory(prefix="waymark-page-") as folder:
        world = pathlib.Path(folder) / "ring.yaml"
        world.write_text(round_world(), encoding="utf-8")
        quick_camera(program, benchmarks, world, pathlib.Path(folder) / "lap.mcap", runs)
        for run in range(runs):
            own = pathlib.Path(folder) / str(run)
            own.mkdir()
            with Robot(own, "--world", world, "--images", "--pace", "1") as robot:
                measured.append(node_json("age.mjs", robot.url.geturl(), 150))
    ages("the same of a simulated robot, its detector among it", measured)


def main():
    program, benchmarks = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    runs = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    bundle()
    recording(program, benchmarks, runs)
    live(program, benchmarks, runs)
    subprocess.run([benchmarks / "live_loop_benchmark", "14", "2"], check=True)
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.path[:0] = [str(TESTS), str(TESTS.parent / "cli")]
    from page_test import browser_tools
    tools = browser_tools(VIEWER)
    sys.exit(77 if tools is None else main())
