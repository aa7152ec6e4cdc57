# %% [markdown]
# # Lab 11: faults, watchdogs and safety
# Whatever moves a robot must end in a standstill when something fails: the program hangs, the cable is pulled, the camera goes dark, a number is no number. You write
# the last instances before the motors, and measure how long a robot goes on driving when its camera fails. (The words fault, reaction and safe state are those of
# IEC 61508-4; what Waymark does is in docs/concepts/replay.md.) 50 minutes.

# %%
import math

import numpy as np

from waymark import config, geometry, labs, replay, samples

lab = labs.Lab("Lab 11")
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
def _expired():
    for fed, now, right in ((None, 0.0, True), (None, 5.0, True), (1.0, 1.0, False), (1.0, 1.2, False), (1.0, 1.26, True), (1.0, 9.0, True), (0.0, 0.1, False), (5.0, 1.0, True)):
        if labs.truth(expired(fed, now)) != right:
            return f"fed at {fed}, asked at {now}: that has {'' if right else 'not '}expired"


def _stopping():
    for v, d, b in ((0.5, 0.0, 1.0), (0.5, 0.3, 1.0), (2.0, 0.1, 4.0), (0.0, 0.3, 1.0)):
        found = labs.number(stopping_m(v, d, b))
        if not np.isclose(found, v * d + v * v / (2 * b)):
            return f"at {v} m/s, {d} s late, with {b} m/s² it does not come {found:.3f} m far" + (": while it brakes it gets slower" if np.isclose(found, v * d + v * v / b) else "")


def _fastest():
    for gap, d, b in ((0.5, 0.0, 1.0), (0.5, 0.3, 1.0), (2.0, 0.1, 4.0)):
        v = labs.number(fastest_m_s(gap, d, b))
        if v < 0 or not np.isclose(v * d + v * v / (2 * b), gap):
            return f"at {v:.3f} m/s the robot comes {v * d + v * v / (2 * b):.3f} m far, and the gap is {gap} m"
    for gap in (0.0, -0.2):
        if not np.isclose(labs.number(fastest_m_s(gap, 0.3, 1.0)), 0):
            return f"a gap of {gap} m allows no speed"


def _limited():
    for v, w in ((math.nan, 0.1), (0.1, math.nan), (math.inf, 0.0), (0.1, -math.inf)):
        try:
            sent = [labs.number(part) for part in labs.several(limited(v, w, 0.5, 1.0), 2)]
        except labs.Wrong as words:
            return f"for ({v}, {w}): {words}"
        if sent != [0, 0]:
            return f"({v}, {w}) is no command: ({sent[0]:g}, {sent[1]:g}) must not be sent"
    for v, w in ((0.3, 0.5), (1.0, 0.5), (0.3, 4.0), (-1.0, -0.5), (-2.0, 3.0), (0.0, -2.0), (0.0, 0.0)):
        found = [labs.number(part) for part in labs.several(limited(v, w, 0.5, 1.0), 2)]
        if abs(found[0]) > 0.5 + 1e-9 or abs(found[1]) > 1.0 + 1e-9:
            return f"({v}, {w}) becomes ({found[0]:.2f}, {found[1]:.2f}), which is too much"
        factor = min(1, 0.5 / abs(v) if v else 1, 1.0 / abs(w) if w else 1)
        if not np.allclose(found, [factor * v, factor * w]):
            return f"({v}, {w}) becomes ({found[0]:.2f}, {found[1]:.2f}): that is another arc" if not np.isclose(found[0] * w, found[1] * v) else \
                f"({v}, {w}) becomes ({found[0]:.2f}, {found[1]:.2f}): slower than it has to be, or backwards"


def _reaction():
    t = np.arange(0, 10, 0.1)
    for speeds, right in ((np.where(t < 5.55, 0.3, 0), 0.6), (np.where((t < 5.55) & ~((t > 5.05) & (t < 5.35)), 0.3, 0), 0.6), (np.where(t < 3, 0.3, 0), 0.0),
                          (np.full(100, 0.3), None), (np.where((t < 5.55) | (t > 8), 0.3, 0), None), (np.where(t < 5.55, -0.3, 0), 0.6), (np.zeros(100), 0.0)):
        found = reaction_s(t, speeds, 5.0)
        if (found is None) != (right is None):
            return "a robot that drives at the end never stopped" if right is None else "it stood at the end, and None says that it never stopped"
        if right is not None and not np.isclose(labs.number(found), right):
            return f"it is {right:.1f} s, and it says {labs.number(found):.1f}" + (": a pause is no stop" if labs.number(found) < right else "")
    found = reaction_s(driven[:, 0], driven[:, 1], BLIND_S)
    if found is None or not 0 < labs.number(found) < 3:
        return f"Waymark's robot stood within three seconds, and it says {found}"
    print(f"      the camera failed at {BLIND_S} s; the robot was commanded to stand after {found:.2f} s: {next(r for r in reversed(reasons) if r)}")


lab.check("the watchdog", 2, _expired)
lab.check("stopping distance", 1, _stopping)
lab.check("the fastest speed", 2, _fastest)
lab.check("the limiter", 3, _limited)
lab.check("the reaction", 2, _reaction)
lab.finish()

# %% [markdown]
# ## Figure
# **Questions:** how far did the robot drive blind, and would your `stopping_m` have foretold it? Which faults does neither watchdog nor limiter notice: wheels in the
# air, a camera that repeats its last picture, a tag that was moved? Change `Blinded` and try one.
# %%
if lab.points == 10:
    labs.figure("commanded speed", "time [s]", "[m/s]", speed=driven, camera_failed=[(BLIND_S, 0), (BLIND_S, driven[:, 1].max())])
