"""Encoders, gyro, and the odometry that a robot's driver computes from them."""
import dataclasses
import math

import numpy as np

import body
from drive import Motion


@dataclasses.dataclass
class SensorOptions:
    odometry: str = "gyro"  # or wheels
    left_scale: float = 1.03  # ratio of the encoder angle to the true angle
    right_scale: float = 1.03
    ticks_per_turn: int = 1560
    gyro_bias_rad_s: float = 0.003
    gyro_bias_walk: float = 0.0002  # rad/s per square root of a second
    gyro_scale: float = 1.005
    gyro_noise_rad_s: float = 0.004
    acceleration_noise_m_s2: float = 0.06


class Sensors:
    def __init__(self, options: SensorOptions, seed: int):
        self._options = options
        self._rng = np.random.default_rng([seed, 2])
        self._bias = options.gyro_bias_rad_s
        self._counted: tuple[float, float] | None = None
        self._pose = [0.0, 0.0, 0.0]
        self._speeds = (0.0, 0.0)
        self._gyro = 0.0
        self._turned = 0.0
        self._stuck_wheels: tuple[float, float] | None = None
        self.encoder_stuck = False
        self.gyro_stuck = False

    def advance(self, motion: Motion, dt_s: float) -> None:
        """Called once per tick: the gyro rotates with the robot."""
        o = self._options
        self._bias += o.gyro_bias_walk * math.sqrt(dt_s) * self._rng.standard_normal()
        if not self.gyro_stuck:
            self._gyro = o.gyro_scale * motion.yaw_rate_rad_s + self._bias + o.gyro_noise_rad_s * self._rng.standard_normal()
        self._turned += self._gyro * dt_s

    def wheels(self, motion: Motion) -> tuple[float, float]:
        """Encoder angles of the wheels of each side."""
        o = self._options
        tick = 2 * math.pi / o.ticks_per_turn
        if not self.encoder_stuck:
            self._stuck_wheels = (math.floor(motion.left_rad * o.left_scale / tick) * tick,
                                  math.floor(motion.right_rad * o.right_scale / tick) * tick)
        return self._stuck_wheels or (0.0, 0.0)

    def odometry(self, motion: Motion, dt_s: float) -> dict[str, float]:
        """Since the last call, dt_s ago."""
        wheels = self.wheels(motion)
        before, self._counted = self._counted or wheels, wheels
        left, right = ((now - then) * body.WHEEL_RADIUS_M for now, then in zip(wheels, before))
        way = (left + right) / 2
        turn = (right - left) / body.TRACK_M if self._options.odometry == "wheels" else self._turned
        self._turned = 0.0
        middle = self._pose[2] + turn / 2
        self._pose[0] += way * math.cos(middle)
        self._pose[1] += way * math.sin(middle)
        self._pose[2] += turn
        keep = math.exp(-dt_s / 0.05)  # drivers smooth their encoder counts
        self._speeds = (keep * self._speeds[0] + (1 - keep) * way / dt_s, keep * self._speeds[1] + (1 - keep) * turn / dt_s)
        yaw = math.atan2(math.sin(self._pose[2]), math.cos(self._pose[2]))
        return {"x_m": self._pose[0], "y_m": self._pose[1], "yaw_rad": yaw,
                "speed_m_s": self._speeds[0], "yaw_rate_rad_s": self._speeds[1]}

    def imu(self, motion: Motion) -> dict[str, list[float]]:
        noise = self._rng.standard_normal(5)
        side, o = motion.yaw_rate_rad_s * 0.25, self._options
        return {"angular_velocity_rad_s": [o.gyro_noise_rad_s * noise[0], o.gyro_noise_rad_s * noise[1], self._gyro],
                "linear_acceleration_m_s2": [motion.forward_acceleration_m_s2 + o.acceleration_noise_m_s2 * noise[2],
                                             side + o.acceleration_noise_m_s2 * noise[3],
                                             9.81 + o.acceleration_noise_m_s2 * noise[4]]}
