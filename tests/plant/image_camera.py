"""The camera with images: perspective with radial distortion, motion blur, rolling shutter, changing exposure, veiling glare, noise, gamma 2.2,
sharpening. Renders with renderer.c; images are files in /dev/shm."""
import atexit
import ctypes
import dataclasses
import math
import pathlib
import shutil
import tempfile

import numpy as np

import body
import course
import frames
import native
import tag_bitmaps
from drive import Motion
from messages import Line

MOMENTS = 96  # poses from the first row's opening to the last row's closing
FILES = 64  # the oldest is overwritten


@dataclasses.dataclass
class ImageOptions:
    readout_s: float = 0.012
    exposure_s: float = 0.010
    exposure_swing: float = 0.5  # relative, of the shutter
    gain_swing: float = 0.35  # relative, remaining error of the exposure control
    swing_period_s: float = 11.0
    veil: float = 0.08
    sharpen: float = 0.18
    shot: float = 0.0004
    read: float = 0.003


class Look(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("exposure_s", "readout_s", "gain", "veil", "sharpen", "shot", "read")] + [("dark", ctypes.c_int)]


class ImageCamera:
    half_window_s = 0.02

    def __init__(self, camera: body.Camera, tags: tuple[course.Tag, ...], seed: int, options: ImageOptions | None = None):
        self._options = options or ImageOptions()
        self._base_T_camera = camera.base_T_camera()
        self._renderer = native.load("renderer.c")
        self._tags = np.ascontiguousarray([tag.world_T_tag()[:3].ravel() for tag in tags])
        self._sizes = np.array([tag.size_m for tag in tags])
        self._bitmaps = np.ascontiguousarray(tag_bitmaps.tag36h11([tag.number for tag in tags]))
        self._lens = np.array([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, camera.k1, camera.k2])
        u, v = np.meshgrid(np.arange(body.WIDTH_PX + 1) - 0.5, np.arange(body.HEIGHT_PX + 1) - 0.5)
        self._rays = np.ascontiguousarray(np.stack(camera.rays(u, v), axis=-1), dtype=np.float32)
        self._seed, self._count = seed, 0
        shared = pathlib.Path("/dev/shm")
        self._folder = pathlib.Path(tempfile.mkdtemp(prefix="plant-", dir=shared if shared.is_dir() else None))
        atexit.register(shutil.rmtree, self._folder, ignore_errors=True)

    def message(self, motions: list[Motion], stamp_s: float, dark: bool) -> Line:
        self._count += 1
        file = self._folder / f"{self._count % FILES}.pgm"
        part = file.with_suffix(".part")
        part.write_bytes(b"P5\n640 480\n255\n" + self.image(motions, stamp_s, dark).tobytes())
        part.rename(file)
        return Line("image", stamp_s, {"path": str(file)})

    def image(self, motions: list[Motion], stamp_s: float, dark: bool = False) -> np.ndarray:
        o = self._options
        phase = 2 * math.pi * stamp_s / o.swing_period_s
        exposure_s = o.exposure_s * (1 + o.exposure_swing * math.sin(phase))
        gain = (1 + o.gain_swing * math.sin(2.3 * phase + 1)) if int(stamp_s) % 9 else 1.5  # every ninth second strongly overexposed
        look = Look(exposure_s, o.readout_s, gain, o.veil, o.sharpen, o.shot, o.read, int(dark))
        poses = self._poses(motions, exposure_s + o.readout_s)
        out = np.empty((body.HEIGHT_PX, body.WIDTH_PX), np.uint8)
        double, single, byte = (ctypes.POINTER(kind) for kind in (ctypes.c_double, ctypes.c_float, ctypes.c_uint8))
        self._renderer.render(poses.ctypes.data_as(double), len(poses), self._tags.ctypes.data_as(double), self._sizes.ctypes.data_as(double),
                              self._bitmaps.ctypes.data_as(byte), len(self._tags), self._lens.ctypes.data_as(double),
                              self._rays.ctypes.data_as(single), ctypes.byref(look), ctypes.c_uint64(self._seed * 1000003 + self._count),
                              out.ctypes.data_as(byte))
        return out

    def _poses(self, motions: list[Motion], window_s: float) -> np.ndarray:
        """World poses of the camera during the exposure, around the middle motion; between ticks the velocity is constant."""
        middle = (len(motions) - 1) / 2
        ticks = middle + np.linspace(-0.5, 0.5, MOMENTS) * window_s / 0.005
        columns = np.array([[m.x_m, m.y_m, m.z_m, m.roll_rad, m.pitch_rad, m.yaw_rad] for m in motions])
        columns[:, 5] = np.unwrap(columns[:, 5])
        at = np.clip(ticks, 0, len(motions) - 1)
        values = [np.interp(at, np.arange(len(motions)), column) for column in columns.T]
        return np.ascontiguousarray([(frames.rigid(frames.roll_pitch_yaw(roll, pitch, yaw), (x, y, z)) @ self._base_T_camera)[:3].ravel()
                                     for x, y, z, roll, pitch, yaw in zip(*values)])
