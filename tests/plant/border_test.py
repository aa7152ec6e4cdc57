#!/usr/bin/python3
"""Tags cut by the image border, rendered by the second judge: their corner covariances must be consistent with the errors.

    tests/plant/border_test.py build/check/bin/waymark
"""
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import body
import corner_camera
import course
import frames
import image_camera
from drive import Motion

SIGMAS = 3.0
LASTING_PX = 0.5  # veil, sharpening and blur displace corners of this camera by this much anywhere in the image
AHEAD_M = 0.5


def motions(roll_rad: float) -> list[Motion]:
    """The tag at increasing distance to the left or right in a rolled camera."""
    return [Motion(y_m=side * out * AHEAD_M, z_m=side * out * AHEAD_M * math.tan(roll_rad)) for side in (-1, 1) for out in np.arange(0.60, 0.78, 0.02)]


def detections(program: str, images: list[pathlib.Path]) -> list[list[dict[str, object]]]:
    """The detections of each image."""
    done = subprocess.run([program, "detect", "--json", *map(str, images)], capture_output=True, text=True, check=True)
    found = {pathlib.Path(line["image"]).name: line["detections"] for line in map(json.loads, done.stdout.splitlines()) if "detections" in line}
    return [found[image.name] for image in images]


def main() -> int:
    images, true_px = [], []
    with tempfile.TemporaryDirectory() as scratch:
        for number, roll_deg in enumerate((5, 15)):
            camera = body.Camera(roll_rad=math.radians(roll_deg))
            tag = course.Tag(7, camera.x_m + AHEAD_M, 0.0, camera.z_m, math.pi)
            eye = image_camera.ImageCamera(camera, (tag,), seed=number)
            for motion in motions(camera.roll_rad):
                images.append(pathlib.Path(scratch) / f"{len(images):03}.pgm")
                images[-1].write_bytes(b"P5\n640 480\n255\n" + eye.image([motion] * 9, 1.0).tobytes())
                world_T_camera = frames.rigid(np.eye(3), (motion.x_m, motion.y_m, motion.z_m)) @ camera.base_T_camera()
                camera_T_world = frames.inverse(world_T_camera)
                true_px.append(camera.project(corner_camera.tag_corners(tag) @ camera_T_world[:3, :3].T + camera_T_world[:3, 3]) + 0.5)
        found = detections(sys.argv[1], images)
    cut, worst_px, worst_sigmas = 0, 0.0, 0.0
    for corners_px, seen in zip(true_px, found):
        for detection in seen:
            off_px = np.abs(np.array(detection["corners_px"]) - corners_px)
            sigmas = np.maximum(off_px - LASTING_PX, 0) / np.array(detection["corner_sigma_px"])
            cut += int(off_px.max() > 1)
            worst_px, worst_sigmas = max(worst_px, off_px.max()), max(worst_sigmas, sigmas.max())
    print(f"{sum(map(len, found))} of {len(images)} found, {cut} with a corner more than a pixel off; the worst by {worst_px:.1f} px, "
          f"{worst_sigmas:.1f} of its standard deviations")
    if cut < 4:
        print("too few tags are cut for a result")
    return 0 if cut >= 4 and worst_sigmas < SIGMAS else 1


if __name__ == "__main__":
    sys.exit(main())
