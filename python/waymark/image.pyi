# Written by tools/update_python_stubs.py.
import os
from typing import Any, Iterable, Iterator, Optional, Union

import numpy as np
from numpy.typing import NDArray

def read(path: Union[str, os.PathLike[str]]) -> NDArray[np.uint8]: ...

def write(path: Union[str, os.PathLike[str]], image: Any) -> None: ...
