#!/usr/bin/python3
"""The pages of web/ in a headless Chromium, opened from their folder: tags in a dropped image agree with those of the program to 1e-3 px, the two
poses of a tag with those of OpenCV.

usage: page_test.py PROGRAM PAGES VIEWER_BUILD_FOLDER
Runs with WAYMARK_FULL only, after tools/build_web.sh (./test.sh --full=site does both). Exit code 77 (skipped) without WAYMARK_FULL, or where npm could
not build the viewer (tools/build_viewer.sh).
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "viewer"))
from page_test import SKIPPED, browser_tools  # noqa: E402  (tests/viewer)

MOST_DIFFERENCE_PX = 1e-3
# The constants of web/two_poses.cpp.
CAMERA = numpy.array([[600, 0, 320], [0, 600, 240], [0, 0, 1]], float)
HALF_M = 0.05
TAG = numpy.array([[-HALF_M, -HALF_M, 0], [HALF_M, -HALF_M, 0], [HALF_M, HALF_M, 0], [-HALF_M, HALF_M, 0]])


def images(program, folder):
    """Rendered photographs with known tags, and a colour JPEG of one."""
    subprocess.run([program, "samples", folder / "samples"], check=True, capture_output=True)
    found = sorted((folder / "samples").rglob("*.png"))
    if not found:
        raise SystemExit("samples wrote no image")
    return found


def native(program, image):
    """Corners by tag, detected by the program."""
    line = subprocess.run([program, "detect", "--json", "--set", "detector.detector=waymark", image], check=True, capture_output=True, text=True).stdout
    return {tag["tag"]: numpy.array(tag["corners_px"], float) for tag in json.loads(line)["detections"]}


def check_image(program, image, answer):
    expected = native(program, image)
    got = {tag["tag"]: numpy.array(tag["corners_px"], float) for tag in answer["tags"]}
    if expected.keys() != got.keys():
        raise SystemExit(f"{image.name}: the program finds {sorted(expected)}, the page {sorted(got)}")
    worst = max((abs(expected[tag] - got[tag]).max() for tag in expected), default=0)
    if worst > MOST_DIFFERENCE_PX:
        raise SystemExit(f"{image.name}: corners differ by {worst:.6f} px")
    return len(expected), worst


def minima(observed):
    """(rms [px], tilt [deg]) of both poses: the closed form of OpenCV (IPPE_SQUARE), refined to minima of the reprojection error; smallest error first."""
    square = TAG * [1, -1, 1]  # OpenCV wants y up here, so its poses differ by the sign of two axes
    _, rotations, translations, _ = cv2.solvePnPGeneric(square[:, :], observed, CAMERA, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    flip = numpy.diag([1.0, -1.0, -1.0])
    poses = []
    for rotation, translation in zip(rotations, translations):
        rotation, _ = cv2.Rodrigues(cv2.Rodrigues(rotation)[0] @ flip)
        rotation, translation = cv2.solvePnPRefineLM(TAG, observed, CAMERA, None, rotation, translation,
                                                     (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 1000, 1e-12))
        projected = cv2.projectPoints(TAG, rotation, translation, CAMERA, None)[0].reshape(4, 2)
        axis = cv2.Rodrigues(rotation)[0][:, 2]
        poses.append((numpy.sqrt(((projected - observed) ** 2).sum(1).mean()), numpy.degrees(numpy.arctan2(axis[0], axis[2]))))
    return sorted(poses)


def check_poses(setting, answer):
    expected = minima(numpy.array(answer["observed_px"], float))
    got = [(s["rms_px"], s["tilt_deg"]) for s in answer["solutions"]]
    if len(got) == 1:  # both starting points converge to one minimum; then OpenCV's do as well
        assert abs(expected[0][1] - expected[1][1]) < 0.1, (setting, expected, got)
        expected = expected[:1]
    for (rms, tilt), (rms_cv, tilt_cv) in zip(got, expected, strict=True):
        assert abs(rms - rms_cv) < 1e-4, (setting, "rms", got, expected)
        assert abs(tilt - tilt_cv) < 0.05, (setting, "tilt", got, expected)
    if "likelihood_ratio" in answer and answer["solutions"][0]["chi2"] > answer["solutions"][-1]["chi2"]:
        raise SystemExit(f"{setting}: the poses are not in the order of their errors")


def main():
    program, pages, built = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3])
    if not os.environ.get("WAYMARK_FULL"):
        print("only with WAYMARK_FULL (./test.sh --full=site)")
        return SKIPPED
    assert (pages / "waymark.js").exists(), f"{pages} is empty: run tools/build_web.sh (needs emscripten)"
    tools = browser_tools(built)
    if tools is None:
        return SKIPPED
    node, environment = tools
    environment = {**os.environ, **environment}
    for page in ("detect", "two_poses"):
        subprocess.run([node, built / "source/node_modules/typescript/bin/tsc", "--noEmit", "--allowJs", "--strict", "--target", "ES2022", "--lib", "ES2022,DOM,DOM.Iterable",
                        "--types", "", HERE.parents[1] / "web/globals.d.ts", HERE.parents[1] / f"web/page/{page}.js"], check=True)
    notices = (pages / "notices.txt").read_text()
    for library in ("Eigen", "fmt", "expected", "AprilTag", "Emscripten", "musl"):
        assert library.lower() in notices.lower(), f"notices.txt names no {library}"
    with tempfile.TemporaryDirectory(prefix="waymark-web-") as name:
        chosen = images(program, pathlib.Path(name))
        looked = subprocess.run([node, HERE / "page_test.mjs", pages.as_uri(), *map(str, chosen)], env=environment, timeout=600, stdout=subprocess.PIPE, text=True)
        if looked.returncode != 0:
            return 1
        answers = json.loads(looked.stdout)
        assert len(answers["images"]) == len(chosen)
        tags, worst = 0, 0.0
        for image, answer in zip(chosen, answers["images"]):
            count, difference = check_image(program, image, answer)
            tags, worst = tags + count, max(worst, difference)
    assert tags >= 20, f"only {tags} tags in {len(chosen)} images"
    for setting, answer in answers["poses"]:
        check_poses(setting, answer)
    print(f"{tags} tags in {len(chosen)} images: corners differ by {worst:.2e} px at most; {len(answers['poses'])} pairs of poses are OpenCV's")
    return 0


if __name__ == "__main__":
    sys.exit(main())
