"""Plant A: a skid-steered robot with contact, friction, suspension and limited torque in MuJoCo (Debian's libmujoco-dev)."""
import ctypes
import math
import pathlib

import numpy as np

import body
import native
from drive import Disturbance, DriveOptions, Motion, MotorSetpoints

RIDE_HEIGHT_M = 0.0406  # of the base of the model over the floor, with its springs at rest


class MujocoPlant:
    def __init__(self, start: tuple[float, float, float], drive: DriveOptions, seed: int):
        self._library = native.load("mujoco_rover.c", "mujoco")
        self._library.rover_open.restype = ctypes.c_void_p
        self._library.rover_open.argtypes = [ctypes.c_char_p] + [ctypes.c_double] * 3
        self._library.rover_advance.argtypes = [ctypes.c_void_p] + [ctypes.c_double] * 5 + [ctypes.c_int] * 2
        self._library.rover_motion.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.POINTER(ctypes.c_double)]
        model = pathlib.Path(__file__).resolve().parent / "rover.xml"
        self._rover = self._library.rover_open(str(model).encode(), *start)
        if not self._rover:
            raise RuntimeError("MuJoCo does not load rover.xml")
        self._options = drive
        self._motors = MotorSetpoints(drive)
        self._rough = np.random.default_rng([seed, 5])
        self._friction = 1.0
        self._time_s = 0.0
        self._speed = 0.0
        self._acceleration = 0.0

    def motion(self) -> Motion:
        out = (ctypes.c_double * 10)()
        self._library.rover_motion(self._rover, RIDE_HEIGHT_M, out)
        return Motion(*out[:6], yaw_rate_rad_s=out[7], left_rad=out[8], right_rad=out[9], forward_acceleration_m_s2=self._acceleration)

    def advance(self, speed_m_s: float, yaw_rate_rad_s: float, dt_s: float, disturbance: Disturbance) -> None:
        self._time_s += dt_s
        left, right = self._motors.advance(speed_m_s, yaw_rate_rad_s, dt_s)
        power = 1 - self._options.sag * min(1.0, self._time_s / self._options.sag_time_s)
        keep = math.exp(-dt_s / 1.0)  # the friction of the floor varies
        self._friction = 1 + keep * (self._friction - 1) + 0.08 * math.sqrt(1 - keep * keep) * self._rough.standard_normal()
        grip = max(0.02, self._friction * disturbance.grip / disturbance.gain_factor)
        self._library.rover_advance(self._rover, dt_s, left / body.WHEEL_RADIUS_M, right / body.WHEEL_RADIUS_M, power, grip,
                                    int(disturbance.held), int(disturbance.blocked))
        speed = self._forward_speed()
        self._acceleration, self._speed = (speed - self._speed) / dt_s, speed

    def _forward_speed(self) -> float:
        out = (ctypes.c_double * 10)()
        self._library.rover_motion(self._rover, RIDE_HEIGHT_M, out)
        return out[6]
