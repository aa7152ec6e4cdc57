"""Waymark: teach a robot a route once and repeat it, using AprilTags and one camera.

There is one module per room, with the names of the C++ library:

    geometry       SO2, SE2, SO3, SE3: exp, log, adjoint, covariance
    camera         CameraModel: project, unproject; calibration files
    image          grey images as NumPy arrays
    families       codes, bitmaps and Hamming distances of tag families
    samples        sensor samples, tag maps, routes, trajectories
    tags           Detector
    pose           pose of a camera from tags, with covariance
    mapping        a map and a route from a recorded lap
    localization   Localizer: riekf, ekf, anchor, smoother
    evaluation     errors against ground truth
    simulation     photographs, a simulated robot, scripted laps
    recording      MCAP and other logs, as iterators and pandas frames
    replay         drive a custom robot along a route
    config         files of worlds, robots, maps and routes

Conventions: a_T_b transforms coordinates of b to a. Tangents are translation, then rotation, in the parent frame. Pixel (i, j) has
its centre at (i + 1/2, j + 1/2). Units are SI and radians; stamps are nanoseconds. Errors are exceptions of waymark.errors.
"""

import os as _os
import sys as _sys
from importlib.util import find_spec as _find_spec

_share = _os.path.join(_os.path.dirname(__file__), "share")
if _os.path.isdir(_share):  # a wheel contains the worlds and robots
    _os.environ.setdefault("WAYMARK_SHARE", _share)

try:
    from . import _waymark, errors  # noqa: E402
except ImportError as _error:
    if "_waymark" not in str(_error):
        raise
    raise ImportError(f"waymark: no extension module for {_sys.executable} ({_sys.implementation.cache_tag}) in {_os.path.dirname(__file__)}: it was built for "
                      "another Python, or not built. Run that Python (often /usr/bin/python3), or rebuild with this one.") from _error
if _find_spec("numpy") is None:
    raise ImportError(f"waymark needs NumPy, and {_sys.executable} does not have it. Install it (Debian: python3-numpy), or run a Python that has it (often /usr/bin/python3).")
from .errors import WaymarkError  # noqa: E402

for _name in ("camera", "config", "evaluation", "families", "geometry", "image", "localization", "mapping", "pose", "recording",
              "replay", "samples", "simulation", "tags"):
    _module = getattr(_waymark, _name)
    _module.__name__ = f"{__name__}.{_name}"
    _sys.modules[_module.__name__] = _module
    globals()[_name] = _module
    for _value in vars(_module).values():  # so that help() and pickle name the public module
        if getattr(_value, "__module__", "").startswith(f"{__name__}._waymark"):
            try:
                _value.__module__ = _module.__name__
            except (AttributeError, TypeError):
                pass

__version__ = _waymark.__version__
ReplaySession = _waymark.replay.ReplaySession
__all__ = ["ReplaySession", "WaymarkError", "camera", "config", "errors", "evaluation", "families", "geometry", "image", "localization", "mapping", "pose",
           "recording", "replay", "samples", "simulation", "tags"]
