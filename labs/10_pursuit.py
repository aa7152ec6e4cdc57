# %% [markdown]
# # Lab 10: pure pursuit, latency and turn gain
# A robot follows a line by steering for a point ahead of it (Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01). That is enough
# for a robot without latency. Yours executes commands 0.4 s late, and it skids: it turns at half the commanded rate. You write pure pursuit and the compensation that
# keeps it on the line, and compare with Waymark's controllers on the same robot. 60 minutes.

# %%
import numpy as np

from waymark import geometry, labs

PERIOD_S, DELAY_S, TURN_GAIN = 0.05, 0.4, 0.5
LOOK_AHEAD_M = 0.4
s = np.linspace(0, 12, 601)
line = np.column_stack([s, 0.8 * np.sin(0.9 * s)])  # (n, 2) [m], from its beginning to its end

# %% [markdown]
# ## 1. The point ahead
# Start at the point of the line nearest to the robot. Return the first following point that is `ahead_m` or more away from the robot, or the last point if
# there is none.
# <details><summary>Hint</summary>np.argmin finds the nearest; search only after it.</details>

# %%
def goal(line, x, y, ahead_m):
    """(n, 2), three numbers -> (2,)"""
    raise NotImplementedError

# %% [markdown]
# ## 2. The arc to it
# The circle that leaves the robot straight ahead and goes through the point. Return its curvature (1 / radius, positive to the left).
# <details><summary>Hint</summary>In the robot's frame the centre of the circle is at (0, 1 / curvature). The point (gx, gy) is as far from it as the robot.</details>
#
# **Question:** what happens if the look-ahead distance is halved? If it is three times as long? (After the check change `LOOK_AHEAD_M`,
# and check again: a second line shows the result of your value. The points are for the drive at 0.4 m.)

# %%
def curvature(x, y, heading, point):
    """three numbers, (2,) -> number [1/m]"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Where the command takes effect
# `under_way` are the pending commands (speed, true yaw rate): sent but not in effect yet, the oldest first. Each will act for one period. Where will the
# robot be when the next command takes effect?
# <details><summary>Hint</summary>geometry.SE2.exp of a velocity times a period is the motion of that period, in the robot's frame.</details>

# %%
def acts_at(pose, under_way, period_s):
    """geometry.SE2, list of (speed_m_s, yaw_rate_rad_s), number -> geometry.SE2"""
    raise NotImplementedError

# %% [markdown]
# ## 4. How much does it turn?
# From commanded and measured yaw rates, compute the gain that fits best by least squares: measured = gain · commanded.

# %%
def turn_gain(commanded, measured):
    """(n,), (n,) [rad/s] -> number"""
    raise NotImplementedError

# %% [markdown]
# ## 5. The command
# Drive an arc of this curvature with a robot of this turn gain. If the commanded yaw rate would exceed `most_rad_s`, reduce the speed, so that the arc
# stays the same.

# %%
def command(speed_m_s, arc, gain, most_rad_s):
    """four numbers -> (speed [m/s], yaw rate to command [rad/s])"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(10, globals())

# %% [markdown]
# ## Figure, and Waymark's controllers
# The same robot drives the taught route of the samples with two controllers (docs/concepts/replay.md). "pursuit" compensates neither delay nor gain.
# "follower" is given the delay and estimates the gain while driving. **Question:** how does the follower behave differently in the first curve than in the second?
# %%
if lab.points == 10:
    from waymark import config, replay, samples
    from waymark.labs import loops

    labs.figure("the line and both drives", "x [m]", "y [m]", line=line, aware=loops.drive_line(lab.answers, True)[1], naive=loops.drive_line(lab.answers, False)[1])

    class Skidding:
        """Observes tag corners without noise, and executes commands late and with half the turn."""

        def __init__(self):
            self.robot, self.map = config.read_robot("limo"), config.read_map(labs.data("samples/map/map.yaml"))
            self.line = config.read_route(labs.data("samples/map/route.yaml")).points[:, :3]
            self.at, self.off = geometry.SE2(*self.line[0]), []
            self.waiting = [(0.0, 0.0)] * round(DELAY_S / PERIOD_S)

        def step(self, speed_m_s, yaw_rate_rad_s, now_ns):
            self.waiting.append((speed_m_s, yaw_rate_rad_s))
            v, w = self.waiting.pop(0)
            self.at = self.at @ geometry.SE2.exp([v * PERIOD_S, 0, TURN_GAIN * w * PERIOD_S])
            self.off.append(np.hypot(*(self.line[:, :2] - [self.at.x, self.at.y]).T).min())
            cam_T_map = (self.at.lift() @ self.robot.base_T_cam).inverse()
            seen = [(tag, samples.visible_corners(self.robot.camera, cam_T_map @ self.map[tag].map_T_tag, self.map[tag].size_m)) for tag in self.map]
            tags = [samples.TagDetection(tag=tag, corners_px=corners) for tag, corners in seen if corners is not None]
            return [samples.Odometry(stamp_ns=now_ns, odom_T_base=self.at, speed_m_s=v, yaw_rate_rad_s=TURN_GAIN * w), samples.TagFrame(stamp_ns=now_ns, detections=tags)]

    for _controller, _options in (("pursuit", {}), ("follower", {"actuators": {"command_delay_s": DELAY_S, "speed_lag_s": 0.0, "yaw_rate_lag_s": 0.0}})):
        _robot = Skidding()
        _end = replay.drive(labs.data("samples/map"), _robot, controller=_controller, **_options)
        print(f"{_controller}: {_end['state']} {_end['reason'] or ''} after {_end['driven_m']:.1f} m, {np.sqrt(np.mean(np.square(_robot.off))):.3f} m from the line (root mean square)")
