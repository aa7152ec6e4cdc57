# %% [markdown]
# # Lab 7: odometry and calibration
# Wheel odometry has systematic errors: tyres differ in radius from the drawing, and a robot that skids turns less than its wheels indicate. You write the
# odometry of a differential drive and calibrate it on a recorded lap. The last part uses a log of another simulator. 50 minutes. Source: Borenstein and Feng,
# "Measurement and Correction of Systematic Odometry Errors in Mobile Robots", IEEE Transactions on Robotics and Automation 12, 1996.

# %%
import csv

import numpy as np

from waymark import config, geometry, labs, recording, samples

robot = config.read_robot("limo")


def read_lap(name):
    """Wheel angles (n, 2) [rad], the gyro's yaw rate (n,) [rad/s] and the true poses (list of geometry.SE2) of a recording, at 50 Hz."""
    wheels, gyro, truth = {}, {}, {}
    for sample in recording.Recording(labs.data(name)):
        if isinstance(sample, samples.WheelTicks):
            wheels[sample.stamp_ns] = (sample.left_rad, sample.right_rad)
        elif isinstance(sample, samples.ImuSample):
            gyro[sample.stamp_ns] = sample.angular_velocity_rad_s[2]
        elif isinstance(sample, samples.TruthPose):
            T = sample.map_T_base.matrix()
            truth[sample.stamp_ns] = geometry.SE2(T[0, 3], T[1, 3], np.arctan2(T[1, 0], T[0, 0]))
    common = sorted(wheels.keys() & gyro.keys() & truth.keys())
    return np.array([wheels[t] for t in common]), np.array([gyro[t] for t in common]), [truth[t] for t in common]


def read_table(name):
    """The poses (list of geometry.SE2), at 50 Hz, of a table of another simulator."""
    with open(labs.data(name), encoding="utf-8") as file:
        return [geometry.SE2(*(float(row[k]) for k in ("x_m", "y_m", "theta_rad"))) for row in csv.DictReader(file)]


def by_seconds(poses):
    """The motion of each second."""
    return [a.inverse() @ b for a, b in zip(poses[:-50:50], poses[50::50])]


laps = {name: read_lap(f"samples/{name}.mcap") for name in ("lap", "other")}
print(f"{len(laps['lap'][0])} samples; radius {robot.wheel_radius_m} m, track {robot.track_m} m in the robot file")

# %% [markdown]
# ## 1. One step
# The left wheel rolled `left_m`, the right one `right_m`. The wheels are `track_m` apart. On an arc the middle drives their mean, and the robot turns by their
# difference over the track. Return the exact motion `before_T_after`: the heading changes during the step.
# <details><summary>Hint</summary>geometry.SE2.exp computes the motion by a constant velocity for a unit of time: what are its three components?</details>

# %%
def step(left_m, right_m, track_m):
    """three numbers -> geometry.SE2"""
    raise NotImplementedError

# %% [markdown]
# ## 2. The trajectory
# `wheels` are angles since the robot was switched on. The first pose is the identity; each step moves the robot from its current pose.

# %%
def trajectory(wheels, radius_m, track_m):
    """(n, 2) [rad] -> list of n geometry.SE2"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The gyro's bias
# While neither wheel moves, the robot does not turn, and the gyro measures only its bias and noise. Average over the samples at which both angles equal those of the
# previous sample.
#
# **Question:** the bias drifts. For how long would you trust the value?

# %%
def gyro_bias(wheels, rates):
    """(n, 2) [rad], (n,) [rad/s] -> number [rad/s]"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Calibration
# `measured` and `true` are motions over the same second each. Find the two scales that fit the measured distances and turns best, by least squares: true =
# scale · measured. `log()` of a motion is (along, across, turned).
#
# **Question:** one track that replaces `track_m` would do the same as the scale of the turns. Which one?
# <details><summary>Hint</summary>The s that minimises the sum of (t - s m)² is sum(t m) / sum(m²).</details>

# %%
def scales(measured, true):
    """two lists of geometry.SE2 -> (scale of distances, scale of turns)"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(7, globals())

# %% [markdown]
# ## Figure
# The trajectory with the radius and track of the file, the calibrated one, and the truth. Which errors remain after calibration, and which of them could a third parameter remove?
# %%
if lab.points == 10:
    _wheels, _, _truth = laps["other"]
    _distance, _turn = scales(by_seconds(trajectory(_wheels, robot.wheel_radius_m, robot.track_m)), by_seconds(_truth))
    _others = scales(*(by_seconds(read_table(f"plant/{name}.csv")) for name in ("odometry", "truth")))
    print(f"other.mcap: distances x {_distance:.4f}, turns x {_turn:.4f}; a log of another simulator: distances x {_others[0]:.4f}, turns x {_others[1]:.4f} (its heading is a gyro's)")
    _drawn = {"by_the_file": trajectory(_wheels, robot.wheel_radius_m, robot.track_m),
             "calibrated": trajectory(_wheels, robot.wheel_radius_m * _distance, robot.track_m * _distance / _turn)}
    labs.figure("other.mcap", "x [m]", "y [m]", truth=[(p.x, p.y) for p in _truth],
                **{name: [((_truth[0] @ p).x, (_truth[0] @ p).y) for p in poses] for name, poses in _drawn.items()})

# %% [markdown]
# ## Your own robot
# Record a lap of your robot with its wheel angles and tags (`waymark teach`), store it next to the notebook as own.mcap, and run this cell. A real robot has no ground
# truth: the cell uses the trajectory that `waymark map` estimates from the tags; radius and track are those of the robot file in the recording.
#
# **Question:** how far are its two scales from those of the simulated robots? By how much do they differ between two of its laps?
# %%
_own = labs.own_data("own.mcap")
if _own and lab.points == 10:
    _robot, _wheels, _motions = labs.own_seconds(_own)
    _distance, _turn = scales([trajectory(w, _robot.wheel_radius_m, _robot.track_m)[-1] for w in _wheels], _motions)
    print(f"own.mcap: distances x {_distance:.4f}, turns x {_turn:.4f}, in {len(_motions)} seconds between images with tags")
