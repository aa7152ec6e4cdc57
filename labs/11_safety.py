# %% [markdown]
# # Lab 11: faults, watchdogs and safety
# A robot must stop after any failure, such as a blocked program, a pulled cable, a dark camera or a NaN. You write
# the last safety functions before the motors, and measure how long a robot continues to drive after its camera fails. (The terms fault, reaction and safe state are those
# of IEC 61508-4; docs/concepts/replay.md describes Waymark's safety functions.) 50 minutes.

# %%
import math

import numpy as np

from waymark import config, geometry, labs, replay, samples

BLIND_S = 6.0  # when the camera of the robot below fails


class Blinded:
    """A robot without delay whose camera stops at BLIND_S. Its odometry continues."""

    def __init__(self):
        self.robot, self.map = config.read_robot("limo"), config.read_map(labs.data("samples/map/map.yaml"))
        self.at = geometry.SE2(*config.read_route(labs.data("samples/map/route.yaml")).points[0, :3])
        self.start_ns, self.driven = None, []  # (time [s], speed [m/s])

    def step(self, speed_m_s, yaw_rate_rad_s, now_ns):
        self.start_ns = now_ns if self.start_ns is None else self.start_ns
        now_s = (now_ns - self.start_ns) * 1e-9
        self.driven.append((now_s, speed_m_s))
        self.at = self.at @ geometry.SE2.exp([0.05 * speed_m_s, 0, 0.05 * yaw_rate_rad_s])
        events = [samples.Odometry(stamp_ns=now_ns, odom_T_base=self.at, speed_m_s=speed_m_s, yaw_rate_rad_s=yaw_rate_rad_s)]
        if now_s < BLIND_S:
            cam_T_map = (self.at.lift() @ self.robot.base_T_cam).inverse()
            seen = [(tag, samples.visible_corners(self.robot.camera, cam_T_map @ self.map[tag].map_T_tag, self.map[tag].size_m)) for tag in self.map]
            events.append(samples.TagFrame(stamp_ns=now_ns, detections=[samples.TagDetection(tag=tag, corners_px=c) for tag, c in seen if c is not None]))
        return events


blinded, reasons = Blinded(), []
end = replay.drive(labs.data("samples/map"), blinded, on_step=lambda now_ns, step: reasons.append(step.reason))
driven = np.array(blinded.driven)  # (n, 2): time [s], commanded speed [m/s]
print(f"the drive ended: {end['state']}, {end['reason']}")

# %% [markdown]
# ## 1. A watchdog
# The program feeds the watchdog with each command; the robot asks whether it may continue. `fed_s` is the time of the last command, None before the first.
# `now_s` is the robot's clock, which may be set back. The watchdog has expired after more than 0.25 s without a command, without any command, or with a command from the future.
#
# **Question:** why must the watchdog not run in the program that drives?

# %%
def expired(fed_s, now_s):
    """number or None, number [s] -> bool"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Stopping distance
# The robot drives at `speed_m_s`, reacts after `delay_s`, and brakes with `brake_m_s2`. How far does it move?

# %%
def stopping_m(speed_m_s, delay_s, brake_m_s2):
    """three numbers -> number [m]"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Maximum speed
# The inverse: the largest speed at which it still stops within `gap_m`. 0 if the gap is not positive.
# <details><summary>Hint</summary>A quadratic equation. Which of its two roots?</details>

# %%
def fastest_m_s(gap_m, delay_s, brake_m_s2):
    """three numbers -> number [m/s]"""
    raise NotImplementedError

# %% [markdown]
# ## 4. The limiter
# The last function before the motors. If the speed or the yaw rate is not finite, return (0, 0). Beyond `most_m_s` or `most_rad_s`, forwards or backwards, reduce both by
# the same factor, so that the robot stays on its arc.

# %%
def limited(speed_m_s, yaw_rate_rad_s, most_m_s, most_rad_s):
    """four numbers -> (speed, yaw rate)"""
    raise NotImplementedError

# %% [markdown]
# ## 5. The reaction
# From the times and commanded speeds of a drive: how long after the fault was the robot permanently commanded to stop? None, if it never was.
# <details><summary>Hint</summary>A pause is not a stop: look for the last sample with a speed that is not zero.</details>

# %%
def reaction_s(times_s, speeds_m_s, fault_s):
    """(n,), (n,), number -> number [s] from the fault to the first of the zeros that last to the end, 0 if it had stopped already; or None"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(11, globals())

# %% [markdown]
# ## Figure
# **Questions:** how far did the robot drive without the camera, and would your `stopping_m` have predicted it? Which faults does neither watchdog nor limiter detect: wheels in the
# air, a camera that repeats its last image, a tag that was moved? Change `Blinded` and try one.
# %%
if lab.points == 10:
    labs.figure("commanded speed", "time [s]", "[m/s]", speed=driven, camera_failed=[(BLIND_S, 0), (BLIND_S, driven[:, 1].max())])
