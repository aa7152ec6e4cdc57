import numpy as np


def goal(line, x, y, ahead_m):
    away = np.hypot(line[:, 0] - x, line[:, 1] - y)
    near = np.argmin(away)
    far = np.flatnonzero(away[near:] >= ahead_m)
    return line[near + far[0]] if len(far) else line[-1]


def curvature(x, y, heading, point):
    dx, dy = point[0] - x, point[1] - y
    left = -np.sin(heading) * dx + np.cos(heading) * dy
    return 2 * left / (dx**2 + dy**2)


def acts_at(pose, under_way, period_s):
    for v, w in under_way:
        pose = pose @ geometry.SE2.exp([v * period_s, 0, w * period_s])
    return pose


def turn_gain(commanded, measured):
    return (commanded @ measured) / (commanded @ commanded)


def command(speed_m_s, arc, gain, most_rad_s):
    yaw_rate = speed_m_s * arc / gain
    slower = min(1, most_rad_s / abs(yaw_rate)) if yaw_rate != 0 else 1
    return slower * speed_m_s, slower * yaw_rate


WRONG = {
    "a point behind": ("far = np.flatnonzero(away[near:] >= ahead_m)", "near, far = 0, np.flatnonzero(away >= ahead_m)", "that point is behind the robot"),
    "the beginning at the end of the line": ("else line[-1]", "else line[0]", "wrong near the end of the line, where no point is that far"),
    "the nearest point": ("return line[near + far[0]] if len(far) else line[-1]", "return line[near]", "not the first point at that distance from the robot, along the"),
    "the map's frame": ("-np.sin(heading) * dx + np.cos(heading) * dy", "dy", "it depends on the pose of the robot: is the"),
    "heading the wrong way": ("-np.sin(heading) * dx", "np.sin(heading) * dx", "it depends on the pose of the robot: is the"),
    "half the curvature": ("2 * left", "left", "is too straight: it does not go through the point"),
    "moved in the map's frame": ("pose @ geometry.SE2.exp([v * period_s, 0, w * period_s])", "geometry.SE2.exp([v * period_s, 0, w * period_s]) @ pose", "a robot that is commanded straight ahead moves sideways: in"),
    "no period": ("[v * period_s, 0, w * period_s]", "[v, 0, w]", "s moves the robot by"),
    "yaw rate of the command, not the true one": ("0, w * period_s]", "0, TURN_GAIN * w * period_s]", "which yaw rate do the pending commands contain, according to the text?"),
    "turns left out": ("0, w * period_s]", "0, 0]", "does not turn the robot"),
    "turned to the other side": ("0, w * period_s]", "0, -w * period_s]", "the robot turns in the wrong direction"),
    "driven, then turned": ("pose @ geometry.SE2.exp([v * period_s, 0, w * period_s])", "pose @ geometry.SE2(v * period_s, 0, w * period_s)", "ends with the right heading at the wrong position"),
    "only the newest": ("in under_way:", "in under_way[-1:]:", "two equal ones are not: does each act"),
    "newest first": ("in under_way:", "in reversed(under_way):", "one command is correct, but several are not: which acts first?"),
    "commanded over measured": ("(commanded @ measured) / (commanded @ commanded)", "(commanded @ measured) / (measured @ measured)", "where the sum of squares is not minimal"),
    "gain multiplied": ("speed_m_s * arc / gain", "speed_m_s * arc * gain", "does not drive the curvature"),
    "turn cut, speed kept": ("slower * speed_m_s, slower * yaw_rate", "speed_m_s, slower * yaw_rate", "does not drive the curvature"),
}
