import numpy as np


def chain(steps):
    poses = [geometry.SE2()]
    for step in steps:
        poses.append(poses[-1] @ step)
    return poses


def closed(poses):
    missing = poses[-1].inverse().log()
    n = len(poses) - 1
    return [geometry.SE2.exp(i / n * missing) @ pose for i, pose in enumerate(poses)]


def map_error(estimated, truth):
    apart = [estimated[name].map_T_tag.translation - truth[name].map_T_tag.translation for name in estimated if name in truth]
    return np.sqrt(np.mean(np.sum(np.square(apart), axis=1)))


def gain(report, truth):
    return map_error(report.start_map, truth) / map_error(report.map, truth)


WRONG = {
    "step on the left": ("poses[-1] @ step", "step @ poses[-1]"),
    "first pose left out": ("    return poses\n", "    return poses[1:]\n"),
    "not inverted": ("poses[-1].inverse().log()", "poses[-1].log()"),
    "the whole error everywhere": ("i / n * missing", "missing"),
    "only the last pose moved": ("i / n * missing", "(i == n) * missing"),
    "mean distance": ("np.sqrt(np.mean(np.sum(np.square(apart), axis=1)))", "np.mean(np.linalg.norm(apart, axis=1))"),
    "after over before": ("map_error(report.start_map, truth) / map_error(report.map, truth)", "map_error(report.map, truth) / map_error(report.start_map, truth)"),
}
