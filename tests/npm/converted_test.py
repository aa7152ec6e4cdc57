#!/usr/bin/python3
"""Converts recordings of other programs with `waymark convert`, opens the results with `@mcap/core` and decodes every message by
the schema in the file.

usage: converted_test.py PROGRAM NPM_FOLDER     exit code 77 (skipped) without tools/install_validators.sh or WAYMARK_DATA
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

SKIPPED = 77


def main():
    program, npm = sys.argv[1], pathlib.Path(sys.argv[2])
    modules = npm / "node_modules"
    data = pathlib.Path(os.environ.get("WAYMARK_DATA", "/nonexistent"))
    bags = sorted(data.glob("tagslam/test_*/tag_detections.bag.bz2"))
    if not (modules / ".bin/node").exists() or not bags:
        print("no validators (tools/install_validators.sh) or no recordings (WAYMARK_DATA)")
        return SKIPPED
    sources = bags + [data / "lcm/lcmlog-2024-04-15.00", data / "aer1513/measurements.csv.gz"]
    total = 0
    with tempfile.TemporaryDirectory(prefix="waymark-npm-") as folder:
        for number, source in enumerate(sources):
            path = f"{folder}/{number}.mcap"
            made = subprocess.run([program, "convert", "--json", source, path], check=True, capture_output=True, text=True)
            script = pathlib.Path(__file__).with_name("validate_recording.mjs")
            done = subprocess.run([modules / ".bin/node", script, path, "--foreign"], capture_output=True, text=True, check=False,
                                  env={**os.environ, "WAYMARK_NODE_MODULES": str(modules)})
            assert done.returncode == 0, f"{source}: {done.stderr}"
            seen = json.loads(done.stdout)
            count = sum(seen["types"].values())
            assert count == json.loads(made.stdout)["messages"] > 0, source
            assert seen["metadata"]["waymark_convert"]["source"] == source.name
            total += count
            print(f"{source.parent.name}/{source.name}: {seen['types']}")
    print(f"{len(sources)} recordings, {total} messages")
    return 0


if __name__ == "__main__":
    sys.exit(main())
