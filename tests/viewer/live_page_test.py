#!/usr/bin/python3
"""The page of a running robot in a headless Chromium: teach, map and replay with its buttons in simulation, and the camera view.

usage: live_page_test.py PROGRAM VIEWER_BUILD_FOLDER session|images [IMAGES]
session: the robot sends tag corners, which needs little processor time on a busy machine; with IMAGES it also sends images, and the
screenshot of the documentation is written to that folder. images: a short lap with images.
Exit code 77 (skipped) if npm could not build the page (tools/build_viewer.sh).
"""
import math
import os
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cli"))
from page_test import SKIPPED, browser_tools  # noqa: E402


def round_world():
    """A path of 5.7 m in a ring of 18 tags: a lap takes twenty seconds."""
    text = "name: ring\ntag_family: tag36h11\ntag_size_m: 0.16\nanchor_id: 0\ntags:\n"
    for i in range(18):
        angle = math.radians(20 * i + 40)
        text += f"  - {{id: {i}, x_m: {2.0 * math.cos(angle):.3f}, y_m: {2.0 * math.sin(angle):.3f}, z_m: 0.35, facing_deg: {20 * i + 40 - 180}}}\n"
    text += "path_closed: true\npath_m:\n"
    for i in range(36):
        angle = math.radians(10 * i)
        text += f"  - [{0.9 * math.cos(angle):.4f}, {0.9 * math.sin(angle):.4f}]\n"
    return text


def main():
    program, built, what, *images = sys.argv[1:]
    tools = browser_tools(pathlib.Path(built))
    if tools is None:
        return SKIPPED
    node, environment = tools
    from live_test import Robot  # reads the program from the command line
    with tempfile.TemporaryDirectory(prefix="waymark-live-") as folder:
        world = pathlib.Path(folder) / "ring.yaml"
        world.write_text(round_world(), encoding="utf-8")
        # A replay of many laps, so that it does not end during the test.
        how = ["--images", "--pace", "1"] if what == "images" or images else ["--pace", "2"]
        with Robot(folder, "--world", world, "--laps", "50", *how) as robot:
            script = HERE.parents[1] / "viewer/test/live_test.mjs"
            return subprocess.run([node, script, robot.url.geturl(), what, *images], check=False, timeout=570, env={**os.environ, **environment}).returncode


if __name__ == "__main__":
    sys.exit(main())
