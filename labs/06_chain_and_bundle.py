# %% [markdown]
# # Lab 6: a chain of poses compared with bundle adjustment
# A robot drives a lap past 24 tags. Consecutive relative poses form a chain whose error grows with the distance. Bundle adjustment uses all observations at
# once. 45 minutes.

# %%
import tempfile

import numpy as np

from waymark import config, geometry, labs, mapping, recording, simulation

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
# Given are the relative poses `a_T_b` of a robot on a floor from step to step; return all poses in the frame of the first.

# %%
def chain(steps):
    """list of geometry.SE2 (from each pose to the next) -> list of geometry.SE2, one more, the first is the identity"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Closing the loop
# The robot returned to its start, but the chain does not. Distribute the `log` of the missing transform evenly over the n steps: the first pose, number 0, stays;
# pose number i gets the fraction i/n, the last all of it.
# <details><summary>Hint</summary>missing @ last = start. Multiply pose number i on the left by exp(i/n log(missing)); there are n + 1 poses.</details>

# %%
def closed(poses):
    """list of geometry.SE2 whose last should be the identity -> list whose last is"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Error of a map
# The root mean square distance [m] of the centres of the tags that both maps contain. Write it yourself, with NumPy and without `waymark.evaluation`, which has such a function.

# %%
def map_error(estimated, truth):
    """two waymark.samples.TagMap -> number; `for name in estimated`, `estimated[name].map_T_tag.translation`, `name in truth`"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Gain by optimisation
# `report.start_map` is the chain's map, `report.map` the optimised one, `world.tags` the truth. By which factor is the error smaller?
#
# **Question:** what would happen to both without the last metres, in which the robot observes the first tags again?

# %%
def gain(report, truth):
    """the report, a waymark.samples.TagMap -> number"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(6, globals())
