"""Drives the lap like a practised person: looks ahead on the line, deviates from it, and adapts to the turning of the robot."""
import math

import numpy as np

import course
import frames

OVERLAP_M = 1.0
AHEAD = 32  # centimetres of the lap
AHEAD_OF_RECORDED = 16  # its bends are tighter


class Teacher:
    def __init__(self, speed_m_s: float, seed: int, wander_m: float = 0.015, laps: int = 1):
        self._lap, self.speed_m_s = course.lap(), speed_m_s
        self._laps = laps
        self._ahead = AHEAD if course.closed() else AHEAD_OF_RECORDED
        if not course.closed():  # continued straight, so that there is a point to aim at
            x, y, yaw, _ = self._lap[-1]
            beyond = 0.01 * np.arange(1, self._ahead + 1)
            self._lap = np.vstack([self._lap, np.column_stack([x + beyond * math.cos(yaw), y + beyond * math.sin(yaw),
                                                               np.full(len(beyond), yaw), np.zeros(len(beyond))])])
        self._rng = np.random.default_rng([seed, 4])
        self._wander_m, self._off = wander_m, 0.0
        self._index, self._driven_m = 0, 0.0
        self._gain, self._asked = 0.6, 0.0
        self._now = 0.0

    @property
    def done(self) -> bool:
        if course.closed():
            return self._driven_m >= self._laps * course.length_m() + OVERLAP_M
        return self._index >= len(self._lap) - 1 - self._ahead

    def _place(self, step: int) -> int:
        """The index this many steps ahead, cyclic for a closed lap and limited to the ends of an open one."""
        return (self._index + step) % len(self._lap) if course.closed() else min(max(self._index + step, 0), len(self._lap) - 1)

    def command(self, x_m: float, y_m: float, yaw_rad: float, yaw_rate_rad_s: float, dt_s: float) -> tuple[float, float]:
        """Speed and yaw rate; zero in the first second and after the lap."""
        self._now += dt_s
        if self._now < 1.0 or self.done:
            return 0.0, 0.0
        near = [self._place(step) for step in range(-5, 60 if course.closed() else 20)]
        best = min(near, key=lambda i: math.hypot(self._lap[i, 0] - x_m, self._lap[i, 1] - y_m))
        gone = (best - self._index) % len(self._lap)
        if gone < 100:
            self._driven_m += 0.01 * gone
            self._index = best
        keep = math.exp(-dt_s / 3.0)
        self._off = keep * self._off + self._wander_m * math.sqrt(1 - keep * keep) * self._rng.standard_normal()
        aim = self._lap[self._place(self._ahead)]
        aim_x, aim_y = aim[0] - self._off * math.sin(aim[2]), aim[1] + self._off * math.cos(aim[2])
        angle = frames.wrap(math.atan2(aim_y - y_m, aim_x - x_m) - yaw_rad)
        wanted = 2 * self.speed_m_s * math.sin(angle) / math.hypot(aim_x - x_m, aim_y - y_m)
        if abs(self._asked) > 0.1:
            self._gain += 0.4 * dt_s * (yaw_rate_rad_s - self._gain * self._asked) * math.copysign(1, self._asked)
            self._gain = min(1.3, max(0.15, self._gain))
        keep = math.exp(-dt_s / 0.15)
        self._asked = keep * self._asked + (1 - keep) * wanted / self._gain
        return self.speed_m_s, max(-6.0, min(6.0, wanted / self._gain))
