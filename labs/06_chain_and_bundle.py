# %% [markdown]
# # Lab 6: a chain of poses against bundle adjustment
# A lap past 24 tags. Relative poses, one after another, make a chain whose error grows with the way; bundle adjustment uses all observations at once. 45 minutes.

# %%
import tempfile

import numpy as np

from waymark import config, evaluation, geometry, labs, mapping, recording, simulation

lab = labs.Lab("Lab 6")
world, robot = config.read_world("circuit24"), config.read_robot("limo")
folder = tempfile.mkdtemp()
anchor = next(iter(world.tags))
with recording.Writer(folder + "/lap.mcap") as lap:
    lap.add_camera(0, robot.camera, robot.base_T_cam)
    for sample in simulation.scripted_lap(world, robot, seed=6):
        lap.add(sample)
report = mapping.map_recording(folder + "/lap.mcap", folder + "/map", anchor=anchor, map_T_anchor=world.tags[anchor].map_T_tag, tag_size_m=0.16)

# %% [markdown]
# ## 1. A chain
# Relative poses `a_T_b` of a robot on a floor from step to step; give all poses in the frame of the first.

# %%
def chain(steps):
    """list of geometry.SE2 (from each pose to the next) -> list of geometry.SE2, one more, the first is the identity"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Closing the loop
# The robot came back to where it began, but the chain does not. Spread the error `log` of what is missing evenly over the n steps: the first pose, number 0, stays;
# pose number i gets the share i/n, the last all of it.
# <details><summary>Hint</summary>missing @ last = start. Multiply pose number i on the left by exp(i/n log(missing)); there are n + 1 poses.</details>

# %%
def closed(poses):
    """list of geometry.SE2 whose last should be the identity -> list whose last is"""
    raise NotImplementedError

# %% [markdown]
# ## 3. How wrong is a map?
# The root mean square distance [m] of the centres of the tags that both maps have.

# %%
def map_error(estimated, truth):
    """two waymark.samples.TagMap -> number; `for name in estimated`, `estimated[name].map_T_tag.translation`, `name in truth`"""
    raise NotImplementedError

# %% [markdown]
# ## 4. What did optimising gain?
# `report.start_map` is the chain's map, `report.map` the optimised one, `world.tags` the truth. By which factor is the error smaller?
#
# **Question:** what would happen to both without the last metres, in which the robot sees the first tags again?

# %%
def gain(report, truth):
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_random = np.random.default_rng(6)
_steps = [geometry.SE2.exp(np.array([0.3, 0, 2 * np.pi / 40]) + _random.normal(scale=[0.01, 0.01, 0.01])) for _ in range(40)]


def _right_chain():
    poses = [geometry.SE2()]
    for step in _steps:
        poses.append(poses[-1] @ step)
    return poses


def _same(a, b):
    return len(a) == len(b) and all(np.allclose((x.inverse() @ y).log(), 0, atol=1e-9) for x, y in zip(a, b))


def _chain():
    found = [labs.instance(pose, geometry.SE2) for pose in labs.instance(chain(_steps), list)]
    if len(found) != len(_steps) + 1:
        return f"{len(found)} poses of {len(_steps)} steps: the first pose counts too"
    if not _same(found, _right_chain()):
        return "each step is given in the frame of the pose before it: on which side does it multiply?"


def _closed():
    poses = _right_chain()
    found = [labs.instance(pose, geometry.SE2) for pose in labs.instance(closed(poses), list)]
    if len(found) != len(poses) or not np.allclose(found[0].log(), 0, atol=1e-9):
        return "the first pose must stay where it is"
    if not np.allclose(found[-1].log(), 0, atol=1e-9):
        return "the last pose is not the first"
    corrections = [(after @ before.inverse()).log() for before, after in zip(poses, found)]
    if not np.allclose(np.diff(corrections, axis=0), corrections[-1] / 40, atol=1e-9):
        return "the error is not spread evenly"


def _error():
    right = evaluation.map_errors(report.map, world.tags)["rmse_m"]
    found = labs.number(map_error(report.map, world.tags))
    if not np.isclose(found, right, rtol=1e-9):
        return f"{found:.4f} m is not it: distances are in space, and the mean is of their squares"
    fewer = config.read_world("circuit24").tags
    del fewer[anchor]
    map_error(report.map, fewer)


def _gain():
    right = evaluation.map_errors(report.start_map, world.tags)["rmse_m"] / evaluation.map_errors(report.map, world.tags)["rmse_m"]
    found = labs.number(gain(report, world.tags))
    if not np.isclose(found, right, rtol=1e-9):
        return f"{found:.2f} is not it: before over after"


lab.check("chain", 3, _chain)
lab.check("closed loop", 3, _closed)
lab.check("error of a map", 2, _error)
lab.check("gain", 2, _gain)
lab.finish()
