#!/usr/bin/python3
"""A running robot watched and driven with Foxglove's client library.

usage: live_test.py PROGRAM NPM_FOLDER     Exit code 77 (skipped) when tools/install_validators.sh has not been run.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / folder) for folder in ("cli", "support")]
from made import MAP, made  # noqa: E402

SKIPPED = 77


def main():
    npm = pathlib.Path(sys.argv[2])
    if not (npm / "node_modules/@foxglove/ws-protocol").exists():
        print("tools/install_validators.sh has not been run")
        return SKIPPED
    from live_test import Robot  # reads the program from the command line
    with tempfile.TemporaryDirectory(prefix="waymark-live-") as folder:
        script = pathlib.Path(folder) / "live_client.mjs"
        shutil.copy(HERE / "live_client.mjs", script)
        (pathlib.Path(folder) / "node_modules").symlink_to(npm.resolve() / "node_modules")

        def client(robot, *words):
            layout = HERE.parents[1] / "share/layouts/foxglove.json"
            return subprocess.run([npm / "node_modules/.bin/node", script, f"ws://127.0.0.1:{robot.url.port}/", robot.token, layout, *words],
                                  check=False, timeout=110).returncode

        with Robot(folder) as robot:
            if client(robot):
                return 1
        shutil.copytree(made(sys.argv[1], *MAP) / "map", pathlib.Path(folder) / "map")
        with Robot(folder, "--map", pathlib.Path(folder) / "map") as robot:
            return client(robot, "24")


if __name__ == "__main__":
    sys.exit(main())
