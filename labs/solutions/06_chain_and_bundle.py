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
    "step on the left": ("poses[-1] @ step", "step @ poses[-1]", "each step is given in the frame of the previous pose: on"),
    "x and y added up": ("poses[-1] @ step", "geometry.SE2(poses[-1].x + step.x, poses[-1].y + step.y, poses[-1].yaw + step.yaw)", "x and y of the steps are added, as if"),
    "steps not multiplied": ("poses[-1] @ step", "step", "these are the given steps"),
    "first pose left out": ("    return poses\n", "    return poses[1:]\n", "steps: the first pose counts as well"),
    "not inverted": ("poses[-1].inverse().log()", "poses[-1].log()", "the last pose does not reach the first"),
    "the whole error everywhere": ("i / n * missing", "missing", "the first pose must not move"),
    "only the last pose moved": ("i / n * missing", "(i == n) * missing", "the error is not distributed evenly: each pose must move a little"),
    "mean distance": ("np.sqrt(np.mean(np.sum(np.square(apart), axis=1)))", "np.mean(np.linalg.norm(apart, axis=1))", "that is the mean distance, which gives large errors"),
    "not written": ("    apart = [", "    from waymark import evaluation\n    return evaluation.map_errors(estimated, truth)[\"rmse_m\"]\n    apart = [", "write it yourself"),
    "after over before": ("map_error(report.start_map, truth) / map_error(report.map, truth)", "map_error(report.map, truth) / map_error(report.start_map, truth)", "if the error is reduced, the factor is above one"),
}
