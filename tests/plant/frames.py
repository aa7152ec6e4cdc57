"""Rigid motions as numpy arrays: a_T_b is 4 x 4 and takes points of b to a; a pose on the floor is (x, y, yaw)."""
import math

import numpy as np


def rotation(axis: int, angle_rad: float) -> np.ndarray:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    matrix = np.eye(3)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    matrix[j, j], matrix[j, k], matrix[k, j], matrix[k, k] = c, -s, s, c
    return matrix


def roll_pitch_yaw(roll_rad: float, pitch_rad: float, yaw_rad: float) -> np.ndarray:
    return rotation(2, yaw_rad) @ rotation(1, pitch_rad) @ rotation(0, roll_rad)


def rigid(matrix: np.ndarray, origin: tuple[float, float, float] | np.ndarray) -> np.ndarray:
    a_T_b = np.eye(4)
    a_T_b[:3, :3], a_T_b[:3, 3] = matrix, origin
    return a_T_b


def inverse(a_T_b: np.ndarray) -> np.ndarray:
    turned = a_T_b[:3, :3].T
    return rigid(turned, -turned @ a_T_b[:3, 3])


def on_floor(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
    return rigid(rotation(2, yaw_rad), (x_m, y_m, 0.0))


def from_quaternion(x: float, y: float, z: float, w: float) -> np.ndarray:
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def wrap(angle_rad: float) -> float:
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))


def compose(a_T_b: tuple[float, float, float], b_T_c: tuple[float, float, float]) -> tuple[float, float, float]:
    c, s = math.cos(a_T_b[2]), math.sin(a_T_b[2])
    return (a_T_b[0] + c * b_T_c[0] - s * b_T_c[1], a_T_b[1] + s * b_T_c[0] + c * b_T_c[1], wrap(a_T_b[2] + b_T_c[2]))


def rotation_vector(matrix: np.ndarray) -> np.ndarray:
    """The rotation vector: its direction is the axis, its length the angle."""
    skew = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]) / 2
    sine, cosine = float(np.linalg.norm(skew)), (float(np.trace(matrix)) - 1) / 2
    if sine > 1e-9:
        return skew * (math.atan2(sine, cosine) / sine)
    if cosine > 0:
        return skew
    column = int(np.argmax(np.diag(matrix)))  # a half turn
    axis = (matrix + np.eye(3))[:, column]
    return math.pi * axis / float(np.linalg.norm(axis))
