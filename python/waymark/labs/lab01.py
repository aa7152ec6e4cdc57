"""The checks of lab 1, frames and SE(3). Do the lab before reading them."""
import numpy as np

from .. import geometry
from . import numbers


def poses(count):
    random = np.random.default_rng(1)
    return [geometry.SE3.exp(np.concatenate([random.normal(size=3), random.normal(scale=0.8, size=3)])).matrix() for _ in range(count)]


def inverse(mine):
    for T in poses(5):
        found = numbers(mine.inverse(T.copy()), (4, 4))
        if not np.allclose(found[3], [0, 0, 0, 1]):
            return "the last row is not that of a homogeneous matrix"
        if not np.allclose(found[:3, :3] @ T[:3, :3], np.eye(3), atol=1e-9):
            return "the rotation part is not the inverse"
        if not np.allclose(found @ T, np.eye(4), atol=1e-9):
            return "the rotation is correct, but the translation is wrong: transform a point by T and back"


def tag_in_map(mine):
    names, still = ("map_T_base", "base_T_cam", "cam_T_tag"), np.eye(4)
    for place, T in enumerate(poses(3)):
        alone = [T if k == place else still for k in range(3)]
        if not np.allclose(numbers(mine.tag_in_map(*alone), (4, 4)), T, atol=1e-9):
            return f"with {names[place]} alone and identities for the others, the tag is in a different place: in which direction does it transform coordinates?"
    a, b, c = poses(3)
    found = numbers(mine.tag_in_map(a, b, c), (4, 4))
    if not np.allclose(found @ np.linalg.inv(c), a @ b, atol=1e-9):
        return "each one alone is correct, but their order is not: which names are neighbours?"


def rotation(mine):
    random = np.random.default_rng(2)
    for scale in (1.0, 3.0, 1e-3):
        w = random.normal(size=3)
        w *= scale / np.linalg.norm(w)
        R = numbers(mine.rotation(w.copy()), (3, 3))
        if np.allclose(R, geometry.SO3.exp(w).matrix(), atol=1e-8):
            continue
        if np.allclose(R, geometry.SO3.exp(-w).matrix(), atol=1e-8):
            return "it rotates in the opposite direction"
        return f"at an angle of {scale} rad it is {'a different rotation' if np.allclose(R.T @ R, np.eye(3)) else 'not a rotation: lengths change'}"


def tiny_rotation(mine):
    for angle in (0.0, 1e-9, 1e-200):
        with np.errstate(all="ignore"):
            R = mine.rotation(np.array([angle, 0, 0]))
        if isinstance(R, np.ndarray) and R.dtype.kind == "f" and not np.isfinite(R).all():
            return f"not a number at an angle of {angle} rad"
        if abs(numbers(R, (3, 3))[2, 1] - angle) > 1e-15:
            return f"at an angle of {angle} rad the small part is lost"


CHECKS = [("inverse", 3, inverse), ("tag in the map", 3, tag_in_map), ("rotation", 2, rotation), ("rotation by tiny angles", 2, tiny_rotation)]
