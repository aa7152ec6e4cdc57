"""Bitmaps of tags drawn by the AprilTag library."""
import ctypes

import numpy as np

CELLS = 10  # of a side of tag36h11 with the white border; the black square has eight


class _Image(ctypes.Structure):
    _fields_ = [("width", ctypes.c_int32), ("height", ctypes.c_int32), ("stride", ctypes.c_int32),
                ("buf", ctypes.POINTER(ctypes.c_uint8))]


def bitmaps(family: str, ids: list[int]) -> np.ndarray:
    """For each id the cells of the whole print, 0 black and 1 white; the first row is at the top as seen from the front."""
    library = ctypes.CDLL("libapriltag.so.3")
    create = getattr(library, f"{family}_create")
    create.restype = ctypes.c_void_p
    library.apriltag_to_image.restype = ctypes.POINTER(_Image)
    library.apriltag_to_image.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
    drawn, all_cells = create(), []
    for tag in ids:
        image = library.apriltag_to_image(drawn, tag).contents
        rows = [[image.buf[row * image.stride + column] > 127 for column in range(image.width)] for row in range(image.height)]
        all_cells.append(np.array(rows, np.uint8))
    return np.stack(all_cells)


def tag36h11(ids: list[int]) -> np.ndarray:
    cells = bitmaps("tag36h11", ids)
    assert cells.shape[1:] == (CELLS, CELLS)
    return cells
