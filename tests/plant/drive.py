"""Shared by both plants: the path of a command to the wheels, and the plant interface."""
import collections
import dataclasses
import math
import typing

import body


@dataclasses.dataclass
class DriveOptions:
    delay_s: float = 0.06  # from a command to the motors
    lag_s: float = 0.12  # time constant of the motors' controller
    dead_zone_m_s: float = 0.02  # a wheel with a lower setpoint does not turn
    sag: float = 0.10  # fraction of the speed lost while the battery discharges
    sag_time_s: float = 120.0  # duration of that discharge


@dataclasses.dataclass
class Disturbance:
    """The current effect of a fault on the plant."""
    held: bool = False  # the robot is held, its wheels turn
    blocked: bool = False  # the wheels do not turn
    grip: float = 1.0  # remaining share of friction
    gain_factor: float = 1.0  # another floor


@dataclasses.dataclass
class Motion:
    """Pose and motion of the robot: world_T_base on the floor, and the angles of the wheels."""
    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    left_rad: float = 0.0
    right_rad: float = 0.0
    forward_acceleration_m_s2: float = 0.0


class Plant(typing.Protocol):
    def motion(self) -> Motion: ...
    def advance(self, speed_m_s: float, yaw_rate_rad_s: float, dt_s: float, disturbance: Disturbance) -> None: ...


class MotorSetpoints:
    """Delay, lag, dead zone and sag between a velocity command and the speed setpoints of each side's wheels."""

    def __init__(self, options: DriveOptions):
        self._options = options
        self._queue: collections.deque[tuple[float, float, float]] = collections.deque()
        self._asked = (0.0, 0.0)
        self._lagged = [0.0, 0.0]
        self._time_s = 0.0

    def advance(self, speed_m_s: float, yaw_rate_rad_s: float, dt_s: float) -> tuple[float, float]:
        """Speeds over ground of the left and right wheels [m/s]."""
        self._time_s += dt_s
        self._queue.append((self._time_s + self._options.delay_s, speed_m_s, yaw_rate_rad_s))
        while self._queue and self._queue[0][0] <= self._time_s + 1e-9:
            _, speed, turn = self._queue.popleft()
            self._asked = (speed - turn * body.TRACK_M / 2, speed + turn * body.TRACK_M / 2)
        share = 1 - math.exp(-dt_s / self._options.lag_s)
        for side, asked in enumerate(self._asked):
            self._lagged[side] += share * (asked - self._lagged[side])
        power = 1 - self._options.sag * min(1.0, self._time_s / self._options.sag_time_s)
        return tuple(power * speed if abs(speed) > self._options.dead_zone_m_s else 0.0 for speed in self._lagged)  # type: ignore[return-value]
