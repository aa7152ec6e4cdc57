#!/usr/bin/python3
"""The page of `waymark calibrate camera v4l2:… --view` in a headless Chromium: a board in front of a camera simulated by tests/fake_v4l2.

usage: guided_page_test.py PROGRAM VIEWER_BUILD_FOLDER
Exit code 77 (skipped) where npm could not build the page (tools/build_viewer.sh).
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

import cv2
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cli"))
import calibrate_boards_test as boards  # noqa: E402
from fake_camera import FakeCamera  # noqa: E402
from harness import PROGRAM  # noqa: E402
from page_test import SKIPPED, browser_tools  # noqa: E402

VIEWS = 10
HELD = 26  # frames with the board at one place
BOARD = ("--target", "charuco", *map(str, boards.PrintedBoards.CHARUCO))


def filmed(folder):
    """A camera with a printed board that is held still at one place after the other."""
    subprocess.run([PROGRAM, "tags", "board", "--style", *BOARD[1:], "--dpi", str(boards.DPI), "-o", "sheet.png"], cwd=folder, check=True,
                   capture_output=True)
    photos = folder / "photos"
    photos.mkdir()
    boards.photographs(cv2.imread(str(folder / "sheet.png"), cv2.IMREAD_GRAYSCALE), 0.297, VIEWS, photos, np.random.default_rng(11), scale_px=2 / 3)
    images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(photos.iterdir())]
    camera = FakeCamera(folder / "fake", PROGRAM)
    (folder / "fake/frames").write_bytes(b"".join(image.tobytes() * HELD for image in images))
    height, width = images[0].shape
    camera.add_mode("GREY", width, height, 20, "frames")
    return camera, width, height


def corners_by_part(folder, views, width, height):
    """The corners of the first accepted views, from the calibration file, which contains all corners."""
    kept = [f"views/view-{number:03}.png" for number in range(1, views + 1)]
    subprocess.run([PROGRAM, "calibrate", "camera", *kept, *BOARD, "--lens", "radtan4", "--format", "photonvision",
                    "-o", "corners.json"], cwd=folder, check=True, capture_output=True)
    counts = [0] * 9
    for view in json.loads((folder / "corners.json").read_text())["observations"]:
        for at in view["locationInImageSpace"]:
            counts[3 * min(2, int(3 * (at["y"] + 0.5) / height)) + min(2, int(3 * (at["x"] + 0.5) / width))] += 1
    return counts


def main():
    tools = browser_tools(pathlib.Path(sys.argv[1]))  # harness has removed the program from sys.argv
    if tools is None:
        return SKIPPED
    node, environment = tools
    with tempfile.TemporaryDirectory(prefix="waymark-guided-") as name:
        folder = pathlib.Path(name)
        camera, width, height = filmed(folder)
        process = subprocess.Popen([PROGRAM, "calibrate", "camera", "v4l2:/dev/video0", *BOARD, "--lens", "radtan4",
                                    "--set", "guide.views_at_most=1000", "--set", "guide.focal_share=1e-5", "--set", "guide.capture.new_share=0.02",
                                    "--resume", "views", "--view", "--port", "0", "-o", "calibration.yaml"],
                                   cwd=folder, env=camera.environment(), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        messages = []
        for line in process.stderr:
            messages.append(line)
            if found := re.search(r"the page: (\S+)", line):
                break
        else:
            print("".join(messages), file=sys.stderr)
            return 1
        try:
            looked = subprocess.run([node, HERE.parents[1] / "viewer/test/guided_test.mjs", found.group(1), *sys.argv[2:]], check=False, timeout=300,
                                    env={**os.environ, **environment}, stdout=subprocess.PIPE, text=True)
        finally:
            process.send_signal(signal.SIGINT)
            messages.append(process.communicate(timeout=60)[1])
        if looked.returncode != 0 or process.returncode != 130:
            print("".join(messages), file=sys.stderr)
            return 1
        panel = json.loads(looked.stdout)
        shown = [int(re.search(r"\d+", part["words"]).group()) for part in panel["parts"]]
        expected = corners_by_part(folder, int(panel["facts"].split()[0]), width, height)
        if shown != expected:
            raise SystemExit(f"the page shows {shown} corners in the parts of the image, the views have {expected}")
        if not (folder / "calibration.yaml").exists():
            raise SystemExit("the calibration by the views so far was not written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
