#!/usr/bin/python3
"""The page of `waymark detect v4l2:… --view` in a headless Chromium, with a camera simulated by tests/fake_v4l2.

usage: camera_page_test.py PROGRAM VIEWER_BUILD_FOLDER
Exit code 77 (skipped) where npm could not build the page (tools/build_viewer.sh).
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cli"))
import images  # noqa: E402
from fake_camera import FakeCamera  # noqa: E402
from page_test import SKIPPED, browser_tools  # noqa: E402


def address(process):
    for line in process.stderr:
        if found := re.search(r"the page: (\S+)", line):
            return found.group(1)
    raise SystemExit("the program printed no address")


def main():
    program, built = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
    tools = browser_tools(built)
    if tools is None:
        return SKIPPED
    node, environment = tools
    with tempfile.TemporaryDirectory(prefix="waymark-camera-") as name:
        folder = pathlib.Path(name)
        images.fill(folder)
        camera = FakeCamera(folder / "fake", program)
        camera.play([images.scene(320, 240, images.SCENE_TAGS)], 30, "YUYV")
        process = subprocess.Popen([program, "detect", "v4l2:/dev/video0", "--view", "--port", "0", "--camera", "camera.yaml",
                                    "--tag-size-m", "0.1"], cwd=folder, env=camera.environment(), stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            looked = subprocess.run([node, HERE.parents[1] / "viewer/test/camera_test.mjs", address(process)], check=False, timeout=300,
                                    env={**os.environ, **environment})
        finally:
            process.send_signal(signal.SIGINT)
            messages = process.communicate(timeout=30)[1]
        if looked.returncode != 0 or process.returncode != 130:
            print(messages, file=sys.stderr)
            return 1
        saved, recorded = list(folder.glob("snapshot-*.png")), list(folder.glob("camera-*.mcap"))
        if len(saved) != 1 or len(recorded) != 1:
            raise SystemExit(f"saved {saved}, recorded {recorded}")
        found = subprocess.run([program, "detect", "--json", saved[0]], check=True, capture_output=True, text=True).stdout
        if "tag36h11:42" not in found:
            raise SystemExit(f"the saved image contains {found}")
        info = subprocess.run([program, "info", "--json", recorded[0]], check=True, capture_output=True, text=True).stdout
        if '"/image_raw/compressed"' not in info or '"/camera_info"' not in info:
            raise SystemExit(f"the recording contains {info}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
