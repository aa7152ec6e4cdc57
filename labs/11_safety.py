# %% [markdown]
# # Lab 11: faults, watchdogs and safety
# Whatever moves a robot must end in a standstill when something fails: the program hangs, the cable is pulled, the camera goes dark, a number is no number. You write
# the last instances before the motors, and measure how long a robot goes on driving when its camera fails. (The words fault, reaction and safe state are those of
# IEC 61508-4; what Waymark does is in docs/concepts/replay.md.) 50 minutes.

# %%
import math

import numpy as np

from waymark import config, geometry, labs, replay, samples

BLIND_S = 6.0  # when the camera of the robot below fails


class Blinded:
    """A robot without delay whose camera gives no picture any more from BLIND_S on. Its odometry goes on."""

    def __init__(self):
        self.robot, self.map = config.read_robot("limo"), config.read_map(labs.data("samples/map/map.yaml"))
        self.at = geometry.SE2(*config.read_route(labs.data("samples/map/route.yaml")).points[0, :3])
        self.start_ns, self.driven = None, []  # (time [s], speed [m/s])

    def step(self, speed_m_s, yaw_rate_rad_s, now_ns):
        self.start_ns = now_ns if self.start_ns is None else self.start_ns
        now_s = (now_ns - self.start_ns) * 1e-9
        self.driven.append((now_s, speed_m_s))
        self.at = self.at @ geometry.SE2.exp([0.05 * speed_m_s, 0, 0.05 * yaw_rate_rad_s])
        said = [samples.Odometry(stamp_ns=now_ns, odom_T_base=self.at, speed_m_s=speed_m_s, yaw_rate_rad_s=yaw_rate_rad_s)]
        if now_s < BLIND_S:
            cam_T_map = (self.at.lift() @ self.robot.base_T_cam).inverse()
            seen = [(tag, samples.visible_corners(self.robot.camera, cam_T_map @ self.map[tag].map_T_tag, self.map[tag].size_m)) for tag in self.map]
            said.append(samples.TagFrame(stamp_ns=now_ns, detections=[samples.TagDetection(tag=tag, corners_px=c) for tag, c in seen if c is not None]))
        return said


blinded, reasons = Blinded(), []
end = replay.drive(labs.data("samples/map"), blinded, on_step=lambda now_ns, step: reasons.append(step.reason))
driven = np.array(blinded.driven)  # (n, 2): time [s], commanded speed [m/s]
print(f"the drive ended: {end['state']}, {end['reason']}")

# %% [markdown]
# ## 1. A watchdog
# The program feeds it with each command; the robot asks it whether it may go on. `fed_s` is the time of the last command, None before the first; `now_s` is the robot's
# clock, which may be set back. More than 0.25 s without a command, no command at all, or a command of the future: the time has expired.
#
# **Question:** why must the watchdog not run in the program that drives?

# %%
def expired(fed_s, now_s):
    """number or None, number [s] -> bool"""
    raise NotImplementedError

# %% [markdown]
# ## 2. How far does it go on?
# The robot drives at `speed_m_s`, notices after `delay_s`, and brakes with `brake_m_s2`. How far does it come?

# %%
def stopping_m(speed_m_s, delay_s, brake_m_s2):
    """three numbers -> number [m]"""
    raise NotImplementedError

# %% [markdown]
# ## 3. How fast may it drive?
# The other way round: the largest speed with which it still stops within `gap_m`. 0 where the gap is none.
# <details><summary>Hint</summary>A quadratic equation. Which of its two roots?</details>

# %%
def fastest_m_s(gap_m, delay_s, brake_m_s2):
    """three numbers -> number [m/s]"""
    raise NotImplementedError

# %% [markdown]
# ## 4. The limiter
# The last before the motors. A speed or a yaw rate that is not finite: (0, 0). Beyond `most_m_s` or `most_rad_s`, forwards or backwards: both are made smaller by the
# same factor, so that the robot stays on its arc.

# %%
def limited(speed_m_s, yaw_rate_rad_s, most_m_s, most_rad_s):
    """four numbers -> (speed, yaw rate)"""
    raise NotImplementedError

# %% [markdown]
# ## 5. The reaction
# From the times and commanded speeds of a drive: how long after the fault was the robot commanded to stand, for good? None, if it never was.
# <details><summary>Hint</summary>A pause is no stop: look for the last sample with a speed that is not zero.</details>

# %%
def reaction_s(times_s, speeds_m_s, fault_s):
    """(n,), (n,), number -> number [s] from the fault to the first of the zeros that last to the end, 0 if it stood already; or None"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(11, globals())

# %% [markdown]
# ## Figure
# **Questions:** how far did the robot drive blind, and would your `stopping_m` have foretold it? Which faults does neither watchdog nor limiter notice: wheels in the
# air, a camera that repeats its last picture, a tag that was moved? Change `Blinded` and try one.
# %%
if lab.points == 10:
    labs.figure("commanded speed", "time [s]", "[m/s]", speed=driven, camera_failed=[(BLIND_S, 0), (BLIND_S, driven[:, 1].max())])
