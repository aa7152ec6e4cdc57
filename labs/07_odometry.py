# %% [markdown]
# # Lab 7: odometry and calibration
# Wheels tell how far a robot drove, wrongly: tyres have another radius than the drawing, and a robot that skids turns less than its wheels say. You write the
# odometry of a differential drive and calibrate it on a recorded lap (Borenstein and Feng, "Measurement and Correction of Systematic Odometry Errors in Mobile
# Robots", IEEE Transactions on Robotics and Automation 12, 1996). A last look is at a log of another simulator. 50 minutes.

# %%
import csv

import numpy as np

from waymark import config, geometry, labs, recording, samples

lab = labs.Lab("Lab 7")
robot = config.read_robot("limo")


def read_lap(name):
    """Wheel angles (n, 2) [rad], the gyro's yaw rate (n,) [rad/s] and the true poses (list of geometry.SE2) of a recording, 50 times a second."""
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


laps = {name: read_lap(f"samples/{name}.mcap") for name in ("lap", "other")}
print(f"{len(laps['lap'][0])} samples; radius {robot.wheel_radius_m} m, track {robot.track_m} m by the robot's file")

# %% [markdown]
# ## 1. One step
# The left wheel rolled `left_m`, the right one `right_m`, the wheels are `track_m` apart. On an arc the middle drives their mean, and the robot turns by their
# difference over the track. Give the motion `before_T_after`, exactly, not with the heading at the beginning of the step.
# <details><summary>Hint</summary>A constant velocity for a unit of time is what geometry.SE2.exp computes: what are its three numbers?</details>

# %%
def step(left_m, right_m, track_m):
    """three numbers -> geometry.SE2"""
    raise NotImplementedError

# %% [markdown]
# ## 2. The trajectory
# `wheels` are angles since the robot was switched on. The first pose is the identity; each step moves the robot from where it is.

# %%
def trajectory(wheels, radius_m, track_m):
    """(n, 2) [rad] -> list of n geometry.SE2"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The gyro's bias
# While neither wheel moves, the robot does not turn, and what the gyro says is its bias and noise. Average over the samples at which both angles are those of the
# sample before.
#
# **Question:** the bias wanders. For how long would you trust the number?

# %%
def gyro_bias(wheels, rates):
    """(n, 2) [rad], (n,) [rad/s] -> number [rad/s]"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Calibration
# `measured` and `true` are motions over the same second each. Find the two scales that make the measured distances and turns fit best, by least squares: true =
# scale · measured. `log()` of a motion is (along, across, turned).
#
# **Question:** one track that replaces `track_m` would do the same as the scale of the turns. Which one?
# <details><summary>Hint</summary>The s that makes the sum of (t - s m)² least is sum(t m) / sum(m²).</details>

# %%
def scales(measured, true):
    """two lists of geometry.SE2 -> (scale of distances, scale of turns)"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_random = np.random.default_rng(7)


def _close(a, b):
    return np.allclose((a.inverse() @ b).log(), 0, atol=1e-9)


def _step():
    for left, right in ((0.1, 0.1), (0.1, 0.14), (-0.2, 0.25), (1.0, 2.0)):
        found = labs.instance(step(left, right, 0.4), geometry.SE2)
        right_one = geometry.SE2.exp([(left + right) / 2, 0, (right - left) / 0.4])
        if _close(found, right_one):
            continue
        if not np.isclose(found.yaw, right_one.yaw):
            return "it turns the wrong way" if np.isclose(found.yaw, -right_one.yaw) else f"wheels at {left} and {right} m turn a robot of 0.4 m by {right_one.yaw:.3f} rad, and it says {found.yaw:.3f}"
        return "it is not on the arc: a step of 1 m and 2 m is long" if left == 1 else f"it turns as it should, but ends elsewhere for {left} and {right} m"


def _right_trajectory(wheels, radius, track):
    poses = [geometry.SE2()]
    for left, right in np.diff(wheels, axis=0) * radius:
        poses.append(poses[-1] @ geometry.SE2.exp([(left + right) / 2, 0, (right - left) / track]))
    return poses


def _check_trajectory():
    wheels = np.cumsum(_random.uniform(-0.2, 1.0, (60, 2)), axis=0)
    found, right = trajectory(wheels, 0.05, 0.2), _right_trajectory(wheels, 0.05, 0.2)
    if not isinstance(found, list) or len(found) != len(right):
        return f"{len(wheels)} samples have as many poses, in a list"
    for n, (a, b) in enumerate(zip(found, right)):
        if not _close(labs.instance(a, geometry.SE2), b):
            return "the first pose is the identity" if n == 0 else f"pose {n} is wrong: angles are since the beginning, a step is a difference, and it is in the frame of the pose before"


def _bias():
    moving = np.repeat([0, 1, 0, 1, 0], 40)[:, None] * np.array([0.1, 0.12])
    wheels = np.cumsum(moving, axis=0)
    rates = 0.02 + 3 * moving[:, 0] + _random.normal(scale=0.001, size=len(moving))
    still = np.append(False, (np.diff(wheels, axis=0) == 0).all(axis=1))
    found, right = labs.number(gyro_bias(wheels, rates)), rates[still].mean()
    if not np.isclose(found, right, atol=1e-4):
        return f"a gyro with a bias of 0.02 rad/s on a robot that drives and rests gives {found:.4f}"
    spinning = np.cumsum(np.repeat([[0, 0], [-0.1, 0.1], [0, 0.1]], 40, axis=0), axis=0)
    found = labs.number(gyro_bias(spinning, np.repeat([0.02, 1.0, 0.5], 40)))
    if not np.isclose(found, 0.02, atol=1e-9):
        return f"a robot that turns on the spot is not at rest: {found:.4f}"


def _seconds(poses):
    return [a.inverse() @ b for a, b in zip(poses[:-50:50], poses[50::50])]


def _scales():
    for name in laps:
        wheels, _, truth = laps[name]
        measured, true = _seconds(_right_trajectory(wheels, robot.wheel_radius_m, robot.track_m)), _seconds(truth)
        found = np.array([labs.number(s) for s in labs.several(scales(measured, true), 2)])
        m, t = (np.array([motion.log() for motion in motions]) for motions in (measured, true))
        right = np.array([(m[:, i] * t[:, i]).sum() / (m[:, i] ** 2).sum() for i in (0, 2)])
        for which, a, b in zip(("distances", "turns"), found, right):
            if not np.isclose(a, b, rtol=1e-6):
                return f"the scale of the {which} is upside down" if np.isclose(1 / a, b, rtol=0.02) else \
                    f"{name}.mcap: with the scale {a:.4f} of the {which} the sum of squares is not the least"


def _independent():
    """What the odometry of a robot of another simulator needs."""
    with open(labs.data("plant/odometry.csv"), encoding="utf-8") as file:
        odometry = [geometry.SE2(*(float(row[k]) for k in ("x_m", "y_m", "theta_rad"))) for row in csv.DictReader(file)]
    with open(labs.data("plant/truth.csv"), encoding="utf-8") as file:
        truth = [geometry.SE2(*(float(row[k]) for k in ("x_m", "y_m", "theta_rad"))) for row in csv.DictReader(file)]
    found = labs.several(scales(_seconds(odometry), _seconds(truth)), 2)
    print(f"      a log of another simulator: distances x {found[0]:.4f}, turns x {found[1]:.4f} (its heading is a gyro's)")


lab.check("one step", 2, _step)
lab.check("the trajectory", 2, _check_trajectory)
lab.check("bias of the gyro", 2, _bias)
lab.check("scales", 4, _scales)
if lab.points == 10:
    _independent()
lab.finish()

# %% [markdown]
# ## Figure
# The trajectory by the wheels of the file, calibrated, and the truth. What is left after calibration, and which of it could a third number take away?
# %%
if lab.points == 10:
    _wheels, _, _truth = laps["other"]
    _distance, _turn = scales(_seconds(trajectory(_wheels, robot.wheel_radius_m, robot.track_m)), _seconds(_truth))
    _drawn = {"by_the_file": trajectory(_wheels, robot.wheel_radius_m, robot.track_m),
             "calibrated": trajectory(_wheels, robot.wheel_radius_m * _distance, robot.track_m * _distance / _turn)}
    labs.figure("other.mcap", "x [m]", "y [m]", truth=[(p.x, p.y) for p in _truth],
                **{name: [((_truth[0] @ p).x, (_truth[0] @ p).y) for p in poses] for name, poses in _drawn.items()})
