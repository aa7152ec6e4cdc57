#!/usr/bin/python3
"""Runs the benchmarks of a build and prints the time of our code relative to each peer, measured in the same run.

usage: tools/benchmark_ratios.py FOLDER [--filter REGEX] [--repetitions N]

FOLDER contains the programs (*_benchmark), e.g. build/release/benchmarks. Benchmarks are named TOPIC/ours/CASE and
TOPIC/peer:NAME/CASE; their repetitions are interleaved, and the fastest of each (CPU time) is used, so that other load on
the machine has little influence. A ratio below 1 means that our code is faster. Exit code 1 if a limit in LIMITS is exceeded.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

# (topic, peer): the largest ratio allowed, in every case.
LIMITS = {
    ("detect", "libapriltag, our settings"): 1.03,
    ("localization", "plain_eigen_ekf"): 2.0,
    ("record", "copy and CRC-32"): 2.0,
    ("read by index", "copy and CRC-32"): 2.0,
}
TO_MILLISECONDS = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}


def run(program, options):
    """The lowest CPU time in ms of each benchmark of a program, by name."""
    with tempfile.NamedTemporaryFile(suffix=".json") as out:
        subprocess.run(
            [program, f"--benchmark_filter={options.filter}", f"--benchmark_repetitions={options.repetitions}",
             "--benchmark_enable_random_interleaving=true", "--benchmark_min_time=0.05",
             f"--benchmark_out={out.name}", "--benchmark_out_format=json"],
            check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        text = pathlib.Path(out.name).read_text(encoding="utf-8")
    fastest = {}
    for entry in json.loads(text)["benchmarks"] if text.strip() else []:
        if entry["run_type"] == "iteration":
            name = entry["run_name"]
            time_ms = entry["cpu_time"] * TO_MILLISECONDS[entry["time_unit"]]
            fastest[name] = min(time_ms, fastest.get(name, time_ms))
    return fastest


def compare(fastest):
    """Rows (topic, case, ms, peer, ratio, limit or None); peer and ratio are None if there is no peer."""
    for name, ours_ms in sorted(fastest.items()):
        topic, who, case = (name.split("/", 2) + ["", ""])[:3]
        if who != "ours":
            continue
        peers = [(other, ms) for other, ms in fastest.items()
                 if other.startswith(f"{topic}/peer:") and other.endswith(f"/{case}")]
        if not peers:
            yield topic, case, ours_ms, None, None, None
        for other, peer_ms in sorted(peers):
            peer = other.split("/", 2)[1].removeprefix("peer:")
            yield topic, case, ours_ms, peer, ours_ms / peer_ms, LIMITS.get((topic, peer))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--filter", default=".")
    parser.add_argument("--repetitions", type=int, default=9)
    options = parser.parse_args()
    programs = sorted(p for p in options.folder.glob("*_benchmark") if p.is_file())
    if not programs:
        sys.exit(f"{options.folder} holds no *_benchmark; build the preset 'release' first.")
    exceeded = 0
    print("| what | case | ours, ms | beside | ratio | at most |\n|---|---|---|---|---|---|")
    for program in programs:
        for topic, case, ours_ms, peer, ratio, limit in compare(run(program, options)):
            over = limit is not None and ratio > limit
            exceeded += over
            print(f"| {topic} | {case} | {ours_ms:.4g} | {peer or ''} | {'' if ratio is None else f'{ratio:.3f}'} | "
                  f"{'' if limit is None else limit}{' EXCEEDED' if over else ''} |", flush=True)
    return 1 if exceeded else 0


if __name__ == "__main__":
    sys.exit(main())
