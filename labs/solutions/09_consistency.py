import numpy as np


def turn(heading):
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, -s], [s, c]])


def step_jacobian(heading, u):
    forward = turn(heading) @ u[:2]
    return np.array([[1, 0, -forward[1]], [0, 1, forward[0]], [0, 0, 1]])


def seen_jacobian(state, m):
    y = turn(state[2]).T @ (m - state[:2])
    return np.column_stack([-turn(state[2]).T, [y[1], -y[0]]])


def invariant_jacobian(m):
    return np.array([[1, 0, -m[1]], [0, 1, m[0]]])


def adjoint(state):
    A = np.eye(3)
    A[:2, :2] = turn(state[2])
    A[:2, 2] = state[1], -state[0]
    return A


def share_below(errors, covariances, limit):
    nees = [e @ np.linalg.inv(P) @ e for e, P in zip(errors, covariances)]
    return np.mean(np.array(nees) < limit)


WRONG = {
    "step in the robot's frame": ("forward = turn(heading) @ u[:2]", "forward = u[:2]", "the column of the heading is wrong: in which direction"),
    "heading does not move the end": ("[[1, 0, -forward[1]], [0, 1, forward[0]], [0, 0, 1]]", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "the column of the heading is wrong: in which direction"),
    "rotation not transposed": ("np.column_stack([-turn(state[2]).T", "np.column_stack([-turn(state[2])", "the position part is wrong: in whose frame are"),
    "landmark moves with the robot": ("np.column_stack([-turn(state[2]).T", "np.column_stack([turn(state[2]).T", "the position part is wrong: in whose frame are"),
    "sign of the heading": ("[y[1], -y[0]]", "[-y[1], y[0]]", "the heading part has the wrong sign"),
    "turn of the landmark the other way": ("[[1, 0, -m[1]], [0, 1, m[0]]]", "[[1, 0, m[1]], [0, 1, -m[0]]]", "correct except for the rotation"),
    "turn about the landmark": ("[[1, 0, -m[1]], [0, 1, m[0]]]", "[[1, 0, 0], [0, 1, 0]]", "correct except for the rotation"),
    "lever left out": ("    A[:2, 2] = state[1], -state[0]\n", "", "correct except for the last column"),
    "adjoint of the inverse": ("A[:2, :2] = turn(state[2])", "A[:2, :2] = turn(-state[2])", "the rotation is inverted"),
    "covariance not inverted": ("e @ np.linalg.inv(P) @ e", "e @ P @ e", "so too few are counted: is each error compared with its own"),
    "share above": ("< limit", "> limit", "that is the fraction above"),
}
