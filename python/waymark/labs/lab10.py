"""The checks of lab 10, pure pursuit. Do the lab before reading them."""
import numpy as np

from .. import geometry
from . import instance, number, numbers, several
from .loops import drive_line

LOOK_AHEAD_M = 0.4  # of the drive that is scored


def goal(mine):
    random, line = np.random.default_rng(10), mine.line
    for k in (0, 100, 400, 520, 595, 600):
        x, y = line[k] + random.normal(scale=0.05, size=2)
        away = np.hypot(*(line - [x, y]).T)
        near = np.argmin(away)
        beyond = near + np.flatnonzero(away[near:] >= 0.5)
        found = numbers(mine.goal(line.copy(), x, y, 0.5), (2,))
        if np.allclose(found, line[beyond[0] if len(beyond) else -1]):
            continue
        if len(beyond) == 0:
            return "wrong near the end of the line, where no point is that far ahead"
        return "that point is behind the robot" if np.argmin(np.hypot(*(line - found).T)) < near else \
            "not the first point at that distance from the robot, along the line from the nearest one"


def curvature(mine):
    random = np.random.default_rng(11)
    for radius in (0.5, -2.0, 10.0):
        pose = geometry.SE2(*random.uniform(-2, 2, 3))
        end = pose @ geometry.SE2.exp([0.7, 0, 0.7 / radius])
        found = number(mine.curvature(pose.x, pose.y, pose.yaw, np.array([end.x, end.y])))
        if np.isclose(found * radius, 1, atol=1e-9):
            continue
        if np.isclose(found * radius, -1):
            return "correct except for its sign: which side is positive?"
        if np.isclose(abs(found), abs(radius)):
            return "that is the radius"
        ahead = number(mine.curvature(0.0, 0.0, 0.0, geometry.SE2.exp([0.7, 0, 0.7 / radius]) @ np.zeros(2)))
        if np.isclose(ahead, found, atol=1e-9):
            return f"an arc of curvature {found:.2f} is too {'straight' if abs(found * radius) < 1 else 'narrow'}: it does not go through the point"
        return "it depends on the pose of the robot: is the point in the robot's frame?"


def acts_turning(mine, pose):
    """The error in the motion by one turning command, and by two equal ones."""
    one = pose.inverse() @ instance(mine.acts_at(pose, [(0.4, 0.8)], 0.1), geometry.SE2)
    right = geometry.SE2.exp([0.04, 0, 0.08])
    if np.isclose(one.yaw, 0, atol=1e-9):
        return "a command of 0.4 m/s and 0.8 rad/s does not turn the robot"
    if np.isclose(one.yaw, -right.yaw, atol=1e-9):
        return "the robot turns in the wrong direction: a positive yaw rate turns to the left"
    if not np.isclose(one.yaw, right.yaw, atol=1e-9):
        how = "too little" if abs(one.yaw) < right.yaw else "too much"
        return f"a command of 0.4 m/s and 0.8 rad/s that acts for 0.1 s turns the robot {how}: which yaw rate do the pending commands contain, according to the text?"
    if not np.allclose([one.x, one.y], [right.x, right.y], atol=1e-9):
        return "a robot that drives and turns ends with the right heading at the wrong position: it turns continuously while it drives, neither before nor after"
    two = pose.inverse() @ instance(mine.acts_at(pose, [(0.4, 0.8), (0.4, 0.8)], 0.1), geometry.SE2)
    if not np.allclose((two.inverse() @ right @ right).log(), 0, atol=1e-9):
        return "one command is correct, but two equal ones are not: does each act for one period?"
    return None


def acts_at(mine):
    pose, under_way = geometry.SE2(1, 2, 0.7), [(0.4, 0.5), (0.3, -0.8), (0.2, 0.9)]
    right = pose
    for v, w in under_way:
        right = right @ geometry.SE2.exp([0.1 * v, 0, 0.1 * w])
    if not np.allclose((pose.inverse() @ instance(mine.acts_at(pose, [], 0.1), geometry.SE2)).log(), 0, atol=1e-12):
        return "without pending commands the robot does not move"
    one = (pose.inverse() @ instance(mine.acts_at(pose, [(0.4, 0.0)], 0.1), geometry.SE2)).log()
    if not np.isclose(np.linalg.norm(one), 0.04, atol=1e-9):
        return f"a command of 0.4 m/s that acts for 0.1 s moves the robot by {np.linalg.norm(one):.3f} m"
    if not np.allclose(one[1:], 0, atol=1e-9):
        return "a robot that is commanded straight ahead moves sideways: in whose frame does a command act?"
    if wrong := acts_turning(mine, pose):
        return wrong
    found = instance(mine.acts_at(pose, list(under_way), 0.1), geometry.SE2)
    if not np.allclose((right.inverse() @ found).log(), 0, atol=1e-9):
        return "one command is correct, but several are not: which acts first?"


def turn_gain(mine):
    random = np.random.default_rng(12)
    for gain in (0.6, 0.9):
        commanded = random.uniform(-1, 1, 200)
        measured = gain * commanded + random.normal(scale=0.2, size=200)
        found = number(mine.turn_gain(commanded.copy(), measured.copy()))
        if abs(commanded @ (measured - found * commanded)) > 1e-9 * (commanded @ commanded):  # the derivative of the sum of squares
            return f"it returns {found:.3f}, where the sum of squares is not minimal"


def command(mine):
    for speed, arc, gain, most in ((0.4, 1.0, 0.5, 2.0), (0.4, -2.0, 0.5, 1.0), (0.4, 0.0, 0.5, 1.0), (0.6, 3.0, 0.8, 1.2)):
        with np.errstate(all="ignore"):
            v, w = (number(part) for part in several(mine.command(speed, arc, gain, most), 2))
        if abs(w) > most + 1e-9:
            return f"{w:.2f} rad/s exceeds {most}"
        if not np.isclose(w * gain, v * arc, atol=1e-9):
            return f"at {v:.2f} m/s and {w:.2f} rad/s a robot of gain {gain} does not drive the curvature {arc}"
        if abs(v) > speed + 1e-9 or v < 0:
            return f"it drives {v:.3f} m/s instead of {speed} m/s"
        if v < speed - 1e-9 and abs(w) < most - 1e-9:
            return f"it drives {v:.3f} m/s but could drive faster: it commands {abs(w):.2f} of {most} rad/s"


def rms_from_line(mine, ahead_m):
    """Prints and returns the distances from the line [m] with the written functions, and without prediction and gain."""
    aware, naive = (np.sqrt(np.mean(drive_line(mine, compensates, ahead_m)[0][60:] ** 2)) for compensates in (True, False))
    print(f"      distance from the line, root mean square, looking {ahead_m:g} m ahead: {aware:.3f} m with your functions, {naive:.3f} m without prediction and gain")
    return aware, naive


def whole_line(mine):
    """Scored at a fixed look-ahead distance, so that other values can be tried."""
    aware, naive = rms_from_line(mine, LOOK_AHEAD_M)
    if mine.LOOK_AHEAD_M != LOOK_AHEAD_M:
        rms_from_line(mine, mine.LOOK_AHEAD_M)
    if not (aware < 0.05 and naive > 3 * aware):
        return "the robot does not stay on the line"


CHECKS = [("the point ahead", 2, goal), ("the arc", 2, curvature), ("where the command acts", 2, acts_at), ("the turn gain", 1, turn_gain), ("the command", 2, command)]
WHOLE = ("the whole line", 1, whole_line)
