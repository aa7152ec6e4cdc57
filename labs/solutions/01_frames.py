import numpy as np


def inverse(T):
    R, t = T[:3, :3], T[:3, 3]
    I = np.eye(4)
    I[:3, :3], I[:3, 3] = R.T, -R.T @ t
    return I


def tag_in_map(map_T_base, base_T_cam, cam_T_tag):
    return map_T_base @ base_T_cam @ cam_T_tag


def rotation(w):
    a = np.linalg.norm(w)
    W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    s, c = (1 - a * a / 6, 0.5 - a * a / 24) if a < 1e-4 else (np.sin(a) / a, (1 - np.cos(a)) / a**2)
    return np.eye(3) + s * W + c * W @ W


WRONG = {
    "translation only negated": ("-R.T @ t", "-t", "the rotation is correct, but the translation is wrong: transform a point by T"),
    "translation with R": ("-R.T @ t", "-R @ t", "the rotation is correct, but the translation is wrong: transform a point by T"),
    "chain turned round": ("map_T_base @ base_T_cam @ cam_T_tag", "cam_T_tag @ base_T_cam @ map_T_base", "each one alone is correct, but their order is not: which"),
    "camera turned round": ("@ base_T_cam @", "@ np.linalg.inv(base_T_cam) @", "with base_T_cam alone and identities for the others, the"),
    "cross product of the wrong sign": ("+ s * W", "- s * W", "it rotates in the opposite direction"),
    "no series": ("if a < 1e-4", "if a < 0", "not a number at an angle of"),
}
