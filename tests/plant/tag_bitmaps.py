"""Bitmaps of tag36h11 drawn by the AprilTag library."""
import ctypes

import numpy as np

CELLS = 10  # of a side with the white border; the black square has eight


class _Image(ctypes.Structure):
    _fields_ = [("width", ctypes.c_int32), ("height", ctypes.c_int32), ("stride", ctypes.c_int32),
                ("buf", ctypes.POINTER(ctypes.c_uint8))]


def tag36h11(ids: list[int]) -> np.ndarray:
    """For each id 10 x 10 cells, 0 black and 1 white; the first row is at the top as seen from the front."""
    library = ctypes.CDLL("libapriltag.so.3")
    library.tag36h11_create.restype = ctypes.c_void_p
    library.apriltag_to_image.restype = ctypes.POINTER(_Image)
    library.apriltag_to_image.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
    family = library.tag36h11_create()
    bitmaps = np.zeros((len(ids), CELLS, CELLS), np.uint8)
    for place, tag in enumerate(ids):
        image = library.apriltag_to_image(family, tag).contents
        assert (image.width, image.height) == (CELLS, CELLS)
        rows = [[image.buf[row * image.stride + column] > 127 for column in range(CELLS)] for row in range(CELLS)]
        bitmaps[place] = np.array(rows, np.uint8)
    return bitmaps
