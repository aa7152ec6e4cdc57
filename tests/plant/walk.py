"""A person walks once around a room with a hand-held camera and films the tags on its walls: 24 tags, six degrees of freedom, a video."""
import dataclasses
import math
import pathlib
import subprocess

import numpy as np

import body
import course
import frames
import image_camera
from drive import Motion

RATE_HZ = 30
TICK_S = 0.005
SIDE_M = (6.0, 5.0)  # of the room
TAGS = 24


@dataclasses.dataclass(frozen=True)
class HungTag(course.Tag):
    turn_rad: float = 0.0  # in the plane of the wall, clockwise as seen from the front

    def world_T_tag(self) -> np.ndarray:
        return super().world_T_tag() @ frames.rigid(frames.rotation(2, self.turn_rad), (0.0, 0.0, 0.0))


def tags(rng: np.random.Generator) -> tuple[HungTag, ...]:
    """Six on each wall, between 1.1 and 1.7 m. Tag 0 is mounted straight."""
    hung = []
    for number in range(TAGS):
        wall, place = divmod(number, 6)
        facing = math.pi + wall * math.pi / 2
        half = SIDE_M[wall % 2] / 2
        along = (place - 2.5) * 0.15 * SIDE_M[1 - wall % 2] + rng.uniform(-0.1, 0.1)
        x, y = (frames.rotation(2, wall * math.pi / 2) @ (half, along, 0))[:2]
        hung.append(HungTag(number, x, y, rng.uniform(1.1, 1.7), frames.wrap(facing), turn_rad=rng.uniform(-0.2, 0.2) if number else 0.0))
    return tuple(hung)


class Walk:
    """Steps, sway and tremor, different for each walk."""

    def __init__(self, rng: np.random.Generator, seconds: float):
        self._seconds = seconds
        self._hz = rng.uniform(0.4, 2.5, (6, 2))
        self._phase = rng.uniform(0, 2 * math.pi, (6, 2))
        self._size = rng.uniform(0.4, 1, (6, 2)) / (1 + self._hz)

    def motion(self, time_s: float) -> Motion:
        """Pose of a body frame at the camera's centre, with x along the optical axis."""
        sway = (self._size * np.sin(2 * math.pi * self._hz * time_s + self._phase)).sum(axis=1)
        round_rad = 2.1 * math.pi * time_s / self._seconds - 0.6  # tag 0 is in view at the start and at the end
        return Motion(x_m=0.9 * math.cos(round_rad) + 0.04 * sway[0], y_m=0.7 * math.sin(round_rad) + 0.04 * sway[1], z_m=1.4 + 0.05 * sway[2],
                      roll_rad=0.05 * sway[3], pitch_rad=0.05 * sway[4], yaw_rad=round_rad + 0.06 * sway[5])


def world_T_body(motion: Motion) -> np.ndarray:
    return frames.rigid(frames.roll_pitch_yaw(motion.roll_rad, motion.pitch_rad, motion.yaw_rad), (motion.x_m, motion.y_m, motion.z_m))


def film(file: pathlib.Path, walk: Walk, seconds: float, eye: image_camera.ImageCamera) -> np.ndarray:
    """Writes an H.264 video; returns world_T_body of each image at the middle of the exposure of its middle row."""
    encoder = subprocess.Popen(["ffmpeg", "-y", "-v", "error", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{body.WIDTH_PX}x{body.HEIGHT_PX}", "-r", str(RATE_HZ),
                                "-i", "-", "-pix_fmt", "yuv420p", "-c:v", "libx264", "-crf", "20", "-preset", "fast", str(file)], stdin=subprocess.PIPE)
    assert encoder.stdin is not None
    poses, ticks = [], round(eye.half_window_s / TICK_S)
    for number in range(round(seconds * RATE_HZ)):
        time_s = number / RATE_HZ
        motions = [walk.motion(time_s + TICK_S * tick) for tick in range(-ticks, ticks + 1)]
        encoder.stdin.write(eye.image(motions, time_s).tobytes())
        poses.append(world_T_body(walk.motion(time_s)))
    encoder.stdin.close()
    if encoder.wait() != 0:
        raise RuntimeError(f"ffmpeg did not write {file}")
    return np.array(poses)
