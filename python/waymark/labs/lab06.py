"""The checks of lab 6, a chain of poses against bundle adjustment. Do the lab before reading them."""
from unittest import mock

import numpy as np

from .. import config, evaluation, geometry
from . import Wrong, instance, number


def steps():
    random = np.random.default_rng(6)
    return [geometry.SE2.exp(np.array([0.3, 0, 2 * np.pi / 40]) + random.normal(scale=[0.01, 0.01, 0.01])) for _ in range(40)]


def poses():
    found = [geometry.SE2()]
    for step in steps():
        found.append(found[-1] @ step)
    return found


def listed(answer):
    return [instance(pose, geometry.SE2) for pose in instance(answer, list)]


def chain(mine):
    found = listed(mine.chain(steps()))
    if len(found) != len(steps()) + 1:
        return f"{len(found)} poses for {len(steps())} steps: the first pose counts as well"
    if not np.allclose(found[0].log(), 0, atol=1e-12):
        return "the first pose is not the identity"
    if all(np.allclose((step.inverse() @ after).log(), 0, atol=1e-9) for step, after in zip(steps(), found[1:])):
        return "these are the given steps, each in the frame of the previous pose"
    if np.allclose([(p.x, p.y) for p in found[1:]], np.cumsum([(s.x, s.y) for s in steps()], axis=0), atol=1e-9):
        return "x and y of the steps are added, as if the robot always had its initial heading"
    for step, before, after in zip(steps(), found, found[1:]):
        if not np.allclose((step.inverse() @ before.inverse() @ after).log(), 0, atol=1e-9):
            return "each step is given in the frame of the previous pose: on which side does it multiply?"


def closed(mine):
    before = poses()
    found = listed(mine.closed(poses()))
    if len(found) != len(before) or not np.allclose(found[0].log(), 0, atol=1e-9):
        return "the first pose must not move"
    if not np.allclose(found[-1].log(), 0, atol=1e-9):
        return "the last pose does not reach the first"
    corrections = [(new @ old.inverse()).log() for old, new in zip(before, found)]
    if not np.allclose(np.diff(corrections, axis=0), corrections[-1] / 40, atol=1e-9):
        return "the error is not distributed evenly: each pose must move a little more than the previous one"


def refused(*_given, **_named):
    """Replaces Waymark's function while the student's is called."""
    raise Wrong("it calls evaluation.map_errors: write it yourself")


def map_error(mine):
    estimated, truth = mine.report.map, mine.world.tags
    apart = np.array([estimated[name].map_T_tag.translation - truth[name].map_T_tag.translation for name in estimated])
    with mock.patch.object(evaluation, "map_errors", refused):
        found = number(mine.map_error(estimated, truth))
    if not np.isclose(found, evaluation.map_errors(estimated, truth)["rmse_m"], rtol=1e-9):
        if np.isclose(found, np.linalg.norm(apart, axis=1).mean()):
            return "that is the mean distance, which gives large errors too little weight"
        if np.isclose(found, np.sqrt((apart**2).mean())):
            return "that is the mean over coordinates; a distance has all three"
        if np.isclose(found, np.sqrt((apart[:, :2] ** 2).sum(axis=1).mean())):
            return "tags can have height errors too"
        return f"it returns {found:.4f} m: square, mean and root, in which order?"
    fewer = config.read_world("circuit24").tags
    del fewer[mine.anchor]
    try:
        mine.map_error(estimated, fewer)
    except (KeyError, IndexError):
        return "it looks up a tag in both maps that only one of them has"


def gain(mine):
    right = evaluation.map_errors(mine.report.start_map, mine.world.tags)["rmse_m"] / evaluation.map_errors(mine.report.map, mine.world.tags)["rmse_m"]
    found = number(mine.gain(mine.report, mine.world.tags))
    if np.isclose(found, right, rtol=1e-9):
        return None
    return "if the error is reduced, the factor is above one" if np.isclose(found, 1 / right, rtol=1e-9) else f"it returns {found:.2f}: is map_error() right, and which maps are compared?"


CHECKS = [("chain", 3, chain), ("closed loop", 3, closed), ("error of a map", 2, map_error), ("gain", 2, gain)]
