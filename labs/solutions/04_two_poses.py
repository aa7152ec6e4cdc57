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
    "the pose forgotten": ("lens.project(cam_T_tag @ np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]))", "lens.project(np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]))", "for points that are not in front of the camera: in which frame"),
    "the pose inverted": ("cam_T_tag @ np", "cam_T_tag.inverse() @ np", "for points that are not in front of the camera: in which frame"),
    "the whole side instead of half": ("size_m / 2", "size_m", "the corners are at other positions: is the square as large as the"),
    "bottom left first": ("[[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]", "[[-h, h, 0], [h, h, 0], [h, -h, 0], [-h, -h, 0]]", "the corners are correct, but in a different order"),
    "mean over coordinates": ("np.mean(np.sum((corners(cam_T_tag) - seen_px) ** 2, axis=1))", "np.mean((corners(cam_T_tag) - seen_px) ** 2)", "wrong if all corners are displaced equally, by"),
    "mirrored in the plane": ("2 * (normal @ v) * v - normal", "normal - 2 * (normal @ v) * v", "the component along the line of sight changed its sign: the tag"),
    "position of another length": ("position / np.linalg.norm(position)", "position", "the normal is not a unit vector: is the line of sight one?"),
    "projected, not mirrored": ("2 * (normal @ v) * v - normal", "(normal @ v) * v - normal", "the component along the line of sight is zero"),
    "about the optical axis": ("position / np.linalg.norm(position)", "np.array([0, 0, 1.0])", "it is mirrored about the optical axis"),
    "the smaller error": ("return min((best, other), key=lambda T: abs(T.rotation.matrix()[1, 2]))", "return best", "choices, with each pair in both orders; the"),
    "the one that faces the camera most": ("min((best, other), key=lambda T: abs(T.rotation.matrix()[1, 2]))", "max((best, other), key=lambda T: T.rotation.matrix()[2, 2])", "choices for near ones at various heights and angles"),
    "a component with its sign": ("abs(T.rotation.matrix()[1, 2])", "T.rotation.matrix()[1, 2]", "correct for tags below the camera, but wrong for tags above it"),
}
