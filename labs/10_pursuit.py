# %% [markdown]
# # Lab 10: pure pursuit, latency and yaw gain
# A robot follows a line by steering for a point ahead of it (Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01). That is enough
# for a robot that obeys at once. Yours obeys 0.4 s late, and it skids: of a commanded turn it makes half. You write pure pursuit and what it needs to stay on the
# line all the same, and compare with Waymark's controllers on the same robot. 60 minutes.

# %%
import numpy as np

from waymark import geometry, labs

lab = labs.Lab("Lab 10")
PERIOD_S, DELAY_S, TURN_GAIN = 0.05, 0.4, 0.5
s = np.linspace(0, 12, 601)
line = np.column_stack([s, 0.8 * np.sin(0.9 * s)])  # (n, 2) [m], from its beginning to its end

# %% [markdown]
# ## 1. The point ahead
# From the point of the line nearest to the robot go on along the line to the first point that is `ahead_m` or more away from the robot. The last point, if there is
# none.
# <details><summary>Hint</summary>np.argmin finds the nearest; look only at what comes after it.</details>

# %%
def goal(line, x, y, ahead_m):
    """(n, 2), three numbers -> (2,)"""
    raise NotImplementedError

# %% [markdown]
# ## 2. The arc to it
# The circle that leaves the robot straight ahead and goes through the point. Give its curvature (1 / radius, positive to the left).
# <details><summary>Hint</summary>With the point at (gx, gy) in the robot's frame it is 2 gy / (gx² + gy²).</details>
#
# **Question:** what happens when the look-ahead is halved? When it is three times as long?

# %%
def curvature(x, y, heading, point):
    """three numbers, (2,) -> number [1/m]"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Where the command will act
# `under_way` are the commands (speed, true yaw rate) that were sent and do not act yet, the oldest first; each will act for one period. Where will the robot be when
# the next one acts?
# <details><summary>Hint</summary>geometry.SE2.exp of a velocity times a period is the motion of that period, in the robot's frame.</details>

# %%
def acts_at(pose, under_way, period_s):
    """geometry.SE2, list of (speed_m_s, yaw_rate_rad_s), number -> geometry.SE2"""
    raise NotImplementedError

# %% [markdown]
# ## 4. How much does it turn?
# From yaw rates that were commanded and those that were measured, the gain that fits best by least squares: measured = gain · commanded.

# %%
def turn_gain(commanded, measured):
    """(n,), (n,) [rad/s] -> number"""
    raise NotImplementedError

# %% [markdown]
# ## 5. The command
# Drive an arc of this curvature with a robot of this turn gain. Where the yaw rate to be commanded would be above `most_rad_s`, drive more slowly, so that the arc
# stays the same.

# %%
def command(speed_m_s, arc, gain, most_rad_s):
    """four numbers -> (speed [m/s], yaw rate to command [rad/s])"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_random = np.random.default_rng(10)


def _goal():
    for k in (0, 100, 400, 520, 595, 600):
        x, y = line[k] + _random.normal(scale=0.05, size=2)
        near = np.argmin(np.hypot(*(line - [x, y]).T))
        after = line[near:]
        far = np.flatnonzero(np.hypot(*(after - [x, y]).T) >= 0.5)
        right = after[far[0]] if len(far) else line[-1]
        found = labs.numbers(goal(line, x, y, 0.5), (2,))
        if not np.allclose(found, right):
            if len(far) == 0:
                return "near the end there is no point so far ahead: the last one"
            return "that point lies behind the robot" if np.argmin(np.hypot(*(line - found).T)) < near else "not the first point so far away from the robot, along the line from the nearest one"


def _curvature():
    for radius in (0.5, -2.0, 10.0):
        pose = geometry.SE2(*_random.uniform(-2, 2, 3))
        end = pose @ geometry.SE2.exp([0.7, 0, 0.7 / radius])
        found = labs.number(curvature(pose.x, pose.y, pose.yaw, np.array([end.x, end.y])))
        if not np.isclose(found, 1 / radius, atol=1e-9):
            if np.isclose(found, -1 / radius):
                return "positive is to the left"
            return f"the arc of radius {radius} m has the curvature {1 / radius:.2f}, and it says {found:.2f}: is the point in the robot's frame?"


def _acts():
    pose, under_way = geometry.SE2(1, 2, 0.7), [(0.4, 0.5), (0.3, -0.8), (0.2, 0.9)]
    right = pose
    for v, w in under_way:
        right = right @ geometry.SE2.exp([0.1 * v, 0, 0.1 * w])
    found = labs.instance(acts_at(pose, under_way, 0.1), geometry.SE2)
    if not np.allclose((right.inverse() @ found).log(), 0, atol=1e-9):
        return "each command acts in the robot's frame, for one period, the oldest first"
    if not np.allclose((pose.inverse() @ labs.instance(acts_at(pose, [], 0.1), geometry.SE2)).log(), 0, atol=1e-12):
        return "with nothing under way the robot stays where it is"


def _gain():
    commanded = _random.uniform(-1, 1, 200)
    measured = 0.6 * commanded + _random.normal(scale=0.2, size=200)
    found = labs.number(turn_gain(commanded, measured))
    if not np.isclose(found, commanded @ measured / (commanded @ commanded), rtol=1e-9):
        return f"it says {found:.3f}, and the sum of squares is not the least there"


def _command():
    for speed, arc, gain, most in ((0.4, 1.0, 0.5, 2.0), (0.4, -2.0, 0.5, 1.0), (0.4, 0.0, 0.5, 1.0), (0.6, 3.0, 0.8, 1.2)):
        v, w = (labs.number(part) for part in labs.several(command(speed, arc, gain, most), 2))
        if abs(w) > most + 1e-9:
            return f"{w:.2f} rad/s are more than {most}"
        if not np.isclose(w * gain, v * arc, atol=1e-9):
            return f"at {v:.2f} m/s and {w:.2f} rad/s a robot of gain {gain} does not drive the curvature {arc}"
        if not np.isclose(v, min(speed, np.inf if arc == 0 else most * gain / abs(arc))):
            return f"it drives {v:.3f} m/s, and may as fast as {speed} m/s unless it has to turn too fast"


def _drive(aware):
    """Distances from the line [m] and the way of a robot with delay and half the turns; whether the driver knows."""
    pose, way, off = geometry.SE2(0, 0.1, 0.7), [], []
    waiting = [(0.0, 0.0)] * round(DELAY_S / PERIOD_S)
    for _ in range(700):
        at = acts_at(pose, [(v, TURN_GAIN * w) for v, w in waiting], PERIOD_S) if aware else pose
        arc = curvature(at.x, at.y, at.yaw, goal(line, at.x, at.y, 0.4))
        waiting.append(command(0.4, arc, TURN_GAIN if aware else 1.0, 2.0))
        v, w = waiting.pop(0)
        pose = pose @ geometry.SE2.exp([v * PERIOD_S, 0, TURN_GAIN * w * PERIOD_S])
        way.append((pose.x, pose.y))
        off.append(np.hypot(*(line - way[-1]).T).min())
        if np.hypot(*(line[-1] - way[-1])) < 0.1:
            break
    return np.array(off), way


def _whole():
    if lab.points < 9:
        return "first the others"
    aware, naive = (np.sqrt(np.mean(_drive(knows)[0][60:] ** 2)) for knows in (True, False))
    print(f"      from the line, root mean square: {aware:.3f} m by what you wrote, {naive:.3f} m without prediction and gain")
    if not (aware < 0.05 and naive > 3 * aware):
        return "the robot does not stay on the line"


lab.check("the point ahead", 2, _goal)
lab.check("the arc", 2, _curvature)
lab.check("where the command acts", 2, _acts)
lab.check("the turn gain", 1, _gain)
lab.check("the command", 2, _command)
lab.check("the whole line", 1, _whole)
lab.finish()

# %% [markdown]
# ## Figure, and Waymark's controllers
# The same robot drives the taught route of the samples with "pursuit", which knows neither delay nor gain, and with "follower", which is told the delay and learns the
# gain as it drives (docs/concepts/replay.md). **Question:** what does the follower do in the first curve that it does not in the second?
# %%
if lab.points == 10:
    from waymark import config, replay, samples

    labs.figure("the line and both drives", "x [m]", "y [m]", line=line, aware=_drive(True)[1], naive=_drive(False)[1])

    class Skidding:
        """It sees the corners of tags without noise and obeys late and half."""

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

    for _controller, _told in (("pursuit", {}), ("follower", {"actuators": {"command_delay_s": DELAY_S, "speed_lag_s": 0.0, "yaw_rate_lag_s": 0.0}})):
        _robot = Skidding()
        _end = replay.drive(labs.data("samples/map"), _robot, controller=_controller, **_told)
        print(f"{_controller}: {_end['state']} {_end['reason'] or ''} after {_end['driven_m']:.1f} m, {np.sqrt(np.mean(np.square(_robot.off))):.3f} m from the line (root mean square)")
