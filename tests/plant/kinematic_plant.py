"""Plant B: a skid-steered robot without forces, for many laps. It turns by a fraction of its wheel speeds and slides outwards."""
import dataclasses
import math

import numpy as np

import body
from drive import Disturbance, DriveOptions, Motion, MotorSetpoints


@dataclasses.dataclass
class KinematicOptions:
    turn_gain: float = 0.6  # fraction of the turn of wheels without slip
    pivot_m: float = 0.012  # distance of the point about which it turns, ahead of the base
    speed_slip: float = 0.02  # fraction of the wheels' distance that slips
    slip_noise: float = 0.03  # standard deviation of a varying slip, as a fraction of speed
    slip_time_s: float = 0.4
    gain_step: float = 1.0  # the yaw gain is multiplied by this ...
    gain_step_at_s: float = math.inf  # ... from this time on: carpet


class KinematicPlant:
    def __init__(self, start: tuple[float, float, float], drive: DriveOptions, options: KinematicOptions, seed: int):
        self._options = options
        self._motors = MotorSetpoints(drive)
        self._rng = np.random.default_rng([seed, 1])
        self._motion = Motion(x_m=start[0], y_m=start[1], yaw_rad=start[2])
        self._slip = [0.0, 0.0]
        self._speed = 0.0
        self._time_s = 0.0

    def motion(self) -> Motion:
        return dataclasses.replace(self._motion)

    def advance(self, speed_m_s: float, yaw_rate_rad_s: float, dt_s: float, disturbance: Disturbance) -> None:
        o, m = self._options, self._motion
        self._time_s += dt_s
        left, right = self._motors.advance(speed_m_s, yaw_rate_rad_s, dt_s)
        if disturbance.blocked:
            left = right = 0.0
        m.left_rad += left * dt_s / body.WHEEL_RADIUS_M
        m.right_rad += right * dt_s / body.WHEEL_RADIUS_M
        keep = math.exp(-dt_s / o.slip_time_s)
        for side in (0, 1):
            self._slip[side] = keep * self._slip[side] + o.slip_noise * math.sqrt(1 - keep * keep) * self._rng.standard_normal()
        grip = 0.0 if disturbance.held else min(1.0, disturbance.grip)
        left, right = (grip * wheel * (1 - o.speed_slip + slip) for wheel, slip in zip((left, right), self._slip))
        gain = o.turn_gain * disturbance.gain_factor * (o.gain_step if self._time_s >= o.gain_step_at_s else 1.0)
        speed, turn = (left + right) / 2, gain * (right - left) / body.TRACK_M
        m.forward_acceleration_m_s2 = (speed - self._speed) / dt_s
        self._speed, m.yaw_rate_rad_s = speed, turn
        middle = m.yaw_rad + turn * dt_s / 2
        side = -o.pivot_m * turn
        m.x_m += dt_s * (speed * math.cos(middle) - side * math.sin(middle))
        m.y_m += dt_s * (speed * math.sin(middle) + side * math.cos(middle))
        m.yaw_rad += turn * dt_s
