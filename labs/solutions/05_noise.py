import numpy as np


def pixel_jacobian(p):
    x, y, z = p
    return np.array([[500 / z, 0, -500 * x / z**2], [0, 500 / z, -500 * y / z**2]])


def pose_jacobian():
    rows = []
    for p in cam_corners:
        cross = np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])
        rows.append(pixel_jacobian(p) @ np.hstack([np.eye(3), -cross]))
    return np.vstack(rows)


def bound(J, sigma):
    return np.linalg.inv(J.T @ J / sigma**2)


def mean_nees(errors, P):
    inverse = np.linalg.inv(P)
    return np.mean([e @ inverse @ e for e in errors])


def share_inside(errors, P):
    inverse = np.linalg.inv(P)
    return np.mean([e @ inverse @ e < 12.592 for e in errors])


WRONG = {
    "depth forgotten": ("-500 * x / z**2", "0", "the first two columns are correct, but the third is not"),
    "depth not squared": ("-500 * y / z**2", "-500 * y / z", "the first two columns are correct, but the third is not"),
    "sign of the rotation": ("np.eye(3), -cross", "np.eye(3), cross", "the rotation has the wrong sign"),
    "rotation before translation": ("[np.eye(3), -cross]", "[-cross, np.eye(3)]", "the translation part is wrong"),
    "sigma not squared": ("/ sigma**2", "/ sigma", "how must a covariance change if each error is twice as"),
    "information instead of its inverse": ("return np.linalg.inv(J.T @ J / sigma**2)", "return J.T @ J / sigma**2", "it does not grow with the noise"),
    "covariance not inverted": ("    inverse = np.linalg.inv(P)\n    return np.mean([e @ inverse @ e for", "    inverse = P\n    return np.mean([e @ inverse @ e for", "errors that are consistent with their covariance: which"),
    "quantile of another number of coordinates": ("12.592", "7.815", "errors that are consistent with their covariance"),
}
