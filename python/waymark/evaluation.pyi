# Written by tools/update_python_stubs.py.
import os
from typing import Any, Iterable, Iterator, Optional, Union

import numpy as np
from numpy.typing import NDArray
from . import samples as _samples

def map_errors(estimated: _samples.TagMap, truth: _samples.TagMap) -> dict[str, Any]: ...

def pose_at(trajectory: _samples.Trajectory, stamp_ns: int, max_gap_s: float = ...) -> Any: ...

def score_trajectory(estimate: _samples.Trajectory, reference: _samples.Trajectory, alignment: str = ..., **kwargs: Any) -> dict[str, Any]: ...
