# Written by tools/update_python_stubs.py.
import os
from typing import Any, Iterable, Iterator, Optional, Union

import numpy as np
from numpy.typing import NDArray
from . import camera as _camera
from . import samples as _samples

class Detector:
    def __init__(self, **kwargs: Any) -> None: ...
    def detect(self, image: Any, camera: _camera.CameraModel = ...) -> list[_samples.TagDetection]: ...
