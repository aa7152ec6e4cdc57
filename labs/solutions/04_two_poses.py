import numpy as np


def corners(cam_T_tag):
    h = size_m / 2
    return lens.project(cam_T_tag @ np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]))


def rms(cam_T_tag, seen_px):
    return np.sqrt(np.mean(np.sum((corners(cam_T_tag) - seen_px) ** 2, axis=1)))


def other_normal(normal, position):
    v = position / np.linalg.norm(position)
    return 2 * (normal @ v) * v - normal


def choose(best, other):
    return min((best, other), key=lambda T: abs(T.rotation.matrix()[1, 2]))


WRONG = {
    "the whole side instead of half": ("size_m / 2", "size_m"),
    "bottom left first": ("[[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]", "[[-h, h, 0], [h, h, 0], [h, -h, 0], [-h, -h, 0]]"),
    "mean over coordinates": ("np.mean(np.sum((corners(cam_T_tag) - seen_px) ** 2, axis=1))", "np.mean((corners(cam_T_tag) - seen_px) ** 2)"),
    "mirrored in the plane": ("2 * (normal @ v) * v - normal", "normal - 2 * (normal @ v) * v"),
    "position of another length": ("position / np.linalg.norm(position)", "position"),
    "about the optical axis": ("position / np.linalg.norm(position)", "np.array([0, 0, 1.0])"),
    "the smaller error": ("return min((best, other), key=lambda T: abs(T.rotation.matrix()[1, 2]))", "return best"),
}
