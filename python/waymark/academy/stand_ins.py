"""Replacements for modules that may not be installed, and the simulated clock."""

import builtins
import contextlib
import importlib.util
import io
import os
import random
import sys
import time
import types


class _Detection:
    """A detection with the attributes of pyapriltags."""

    def __init__(self, found):
        self.tag_id = found.id
        self.tag_family = found.tag.split(":")[0].encode()
        self.hamming = found.hamming
        self.decision_margin = found.decision_margin
        self.center = found.center_px
        self.corners = found.corners_px[::-1].copy()  # bottom left, bottom right, top right, top left, the order of libapriltag

    def __repr__(self):
        return f"Detection({self.tag_family.decode()}:{self.tag_id})"


class Detector:
    """pyapriltags.Detector based on Waymark's detector. Uses families and quad_decimate; other arguments are accepted and ignored."""

    def __init__(self, searchpath=None, families="tag36h11", nthreads=1, quad_decimate=1.0, **_other):
        from .. import tags

        self._detector = tags.Detector(detector="apriltag3", families=str(families).split(), quad_decimate=float(quad_decimate), refine=False)

    def detect(self, img, estimate_tag_pose=False, camera_params=None, tag_size=None):
        """Detects tags in a grey image, (height, width) uint8."""
        if estimate_tag_pose:
            raise NotImplementedError("this stand-in for pyapriltags estimates no poses: use cv2.solvePnP on the corners")
        return [_Detection(found) for found in self._detector.detect(img)]


def _pyapriltags():
    module = types.ModuleType("pyapriltags")
    module.Detector = Detector
    return module


def _clock(robot):
    """The module time on the robot's clock."""
    module = types.ModuleType("time")
    module.__dict__.update({name: value for name, value in vars(time).items() if not name.startswith("__")})
    for name in ("time", "monotonic", "perf_counter"):
        setattr(module, name, lambda: robot.now_s)
    module.sleep = robot.sleep
    return module


@contextlib.contextmanager
def installed(robot, tag_file):
    """Replaces HAL, WebGUI, Frequency, the clock, the tag file and seeds while a solution runs, and restores everything afterwards."""
    modules = {**robot.modules(), "time": _clock(robot)}
    if importlib.util.find_spec("pyapriltags") is None:
        modules["pyapriltags"] = _pyapriltags()
    kept = {name: sys.modules.get(name) for name in modules}
    real_open = builtins.open

    def opened(file, *arguments, **keywords):
        if isinstance(file, (str, os.PathLike)) and os.fspath(file) == tag_file:
            return io.StringIO(robot.tags_yaml())
        return real_open(file, *arguments, **keywords)

    state = random.getstate()
    sys.modules.update(modules)
    builtins.open = io.open = opened
    try:
        random.seed(1)
        yield
    finally:
        builtins.open = io.open = real_open
        random.setstate(state)
        for name, module in kept.items():
            if module is None:
                sys.modules.pop(name, None)
            else:
                sys.modules[name] = module
