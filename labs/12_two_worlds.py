# %% [markdown]
# # Lab 12: simulation and reality
# A simulator models only the effects that its authors considered. You compare three robots. The first is that of samples/lap.mcap. The second differs from its
# file, in the same simulator (samples/other.mcap). The third is of another simulator with other physics and other noise (plant/). You identify delay, gain and bias from commands and a gyro,
# and test whether two robots have the same error distribution (two-sample Kolmogorov-Smirnov test; Ljung, "System Identification", chapters 6 and 16). If you have a recording of a
# real robot, use it in place of other.mcap. 60 minutes.

# %%
import csv

import numpy as np

from waymark import geometry, labs, recording, samples

PERIOD_S = 0.02


def read_lap(name):
    """Commanded and measured yaw rate (n,) [rad/s], at 50 Hz; motions by odometry and truth over the same seconds, lists of geometry.SE2."""
    sent, gyro, odometry, truth = {0: 0.0}, {}, {}, {}
    for sample in recording.Recording(labs.data(name)):
        if isinstance(sample, samples.StampedCommand):
            sent[sample.stamp_ns] = sample.yaw_rate_rad_s
        elif isinstance(sample, samples.ImuSample):
            gyro[sample.stamp_ns] = sample.angular_velocity_rad_s[2]
        elif isinstance(sample, samples.Odometry):
            odometry[sample.stamp_ns] = sample.odom_T_base
        elif isinstance(sample, samples.TruthPose):
            T = sample.map_T_base.matrix()
            truth[sample.stamp_ns] = geometry.SE2(T[0, 3], T[1, 3], np.arctan2(T[1, 0], T[0, 0]))
    times = np.arange(min(gyro), max(gyro), int(PERIOD_S * 1e9))
    stamps = np.array(sorted(sent))
    commanded = np.array([sent[stamps[np.searchsorted(stamps, t, "right") - 1]] for t in times])
    common = sorted(odometry.keys() & truth.keys())
    return commanded, np.interp(times, sorted(gyro), [gyro[t] for t in sorted(gyro)]), by_seconds([odometry[t] for t in common]), by_seconds([truth[t] for t in common])


def by_seconds(poses):
    return [a.inverse() @ b for a, b in zip(poses[:-50:50], poses[50::50])]


def read_table(name):
    with open(labs.data(name), encoding="utf-8") as file:
        return by_seconds([geometry.SE2(*(float(row[k]) for k in ("x_m", "y_m", "theta_rad"))) for row in csv.DictReader(file)])


laps = {name: read_lap(f"samples/{name}.mcap") for name in ("lap", "other")}
plant = read_table("plant/odometry.csv"), read_table("plant/truth.csv")


def errors(measured, true):
    """Relative distance error of each second in which the robot drove."""
    return np.array([m.log()[0] / t.log()[0] - 1 for m, t in zip(measured, true) if abs(t.log()[0]) > 0.1])


# %% [markdown]
# ## 1. The delay
# By how many samples, 0 to `most`, must `response` be shifted forward to fit `command` best? Use the correlation coefficient of the overlapping part.
# <details><summary>Hint</summary>For each k compare command[:n - k] with response[k:]. Correlation subtracts the means.</details>

# %%
def delay(command, response, most):
    """(n,), (n,), whole number -> whole number"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Gain and bias
# For a known delay: response = gain · command + bias, by least squares.

# %%
def gain_and_bias(command, response, delayed):
    """(n,), (n,), samples -> (gain, bias [rad/s])"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Residuals
# If the model consisted of delay, gain and bias only, the residuals would be white noise. Return their autocorrelation at lags 1 to `lags`: the mean of r[i] r[i + k]
# divided by the variance, where r are the residuals minus their mean.
#
# **Question:** what do the residuals of the laps show about the motors?

# %%
def autocorrelation(residuals, lags):
    """(n,), whole number -> (lags,)"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Are two robots equal?
# The Kolmogorov-Smirnov statistic: the largest difference between the fractions of `a` and of `b` that are at most x, over all x.
# <details><summary>Hint</summary>It suffices to consider the values of both. np.searchsorted(sorted, x, "right") counts those up to x.</details>

# %%
def apart(a, b):
    """(n,), (m,) -> number from 0 to 1"""
    raise NotImplementedError

# %% [markdown]
# ## 5. Is the difference significant?
# Two samples of the same distribution have a larger statistic than 1.358 sqrt((n + m) / (n m)) in one case of twenty. Do `a` and `b` differ at this level?
#
# **Question:** your simulator and your robot do not differ by this test. What does that prove, with 20 seconds of data? With 20 hours?

# %%
def differ(a, b):
    """(n,), (m,) -> bool"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(12, globals())

# %% [markdown]
# ## Figure
# **Questions:** which of the parameters above are wrong in the robot file? Which of them would degrade a replay that does not estimate them (lab 10)?
# %%
if lab.points == 10:
    _robots_errors = {"lap": errors(*laps["lap"][2:]), "other": errors(*laps["other"][2:]), "plant": errors(*plant)}
    labs.figure("errors of the distances per second", "relative error", "cumulative fraction",
                **{name: list(zip(np.sort(e), np.arange(1, len(e) + 1) / len(e))) for name, e in _robots_errors.items()})
