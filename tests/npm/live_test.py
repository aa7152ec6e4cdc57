#!/usr/bin/python3
"""A running robot watched and driven with Foxglove's own client.

usage: live_test.py PROGRAM NPM_FOLDER     Exit code 77 (skipped) when tools/install_validators.sh has not been run.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cli"))

SKIPPED = 77


def main():
    npm = pathlib.Path(sys.argv[2])
    if not (npm / "node_modules/@foxglove/ws-protocol").exists():
        print("tools/install_validators.sh has not been run")
        return SKIPPED
    from live_test import Robot  # reads the program from the command line
    with tempfile.TemporaryDirectory(prefix="waymark-live-") as folder, Robot(folder) as robot:
        script = pathlib.Path(folder) / "live_client.mjs"
        shutil.copy(HERE / "live_client.mjs", script)
        (pathlib.Path(folder) / "node_modules").symlink_to(npm.resolve() / "node_modules")
        layout = HERE.parents[1] / "share/layouts/foxglove.json"
        return subprocess.run([npm / "node_modules/.bin/node", script, f"ws://127.0.0.1:{robot.url.port}/", robot.token, layout],
                              check=False, timeout=110).returncode


if __name__ == "__main__":
    sys.exit(main())
