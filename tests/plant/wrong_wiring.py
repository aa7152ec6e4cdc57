"""Robots that are wired or programmed wrongly: a sign, an axis or a unit is swapped in their samples or in how they obey commands."""
import collections.abc
import math
import typing

Values = dict[str, typing.Any]
DEGREES = 180 / math.pi


def scaled(kind: str, factor: float, *keys: str) -> collections.abc.Callable[[str, Values], Values]:
    """Multiplies these keys in lines of this kind."""
    def change(line: str, values: Values) -> Values:
        if line != kind:
            return values
        return values | {key: [factor * v for v in values[key]] if isinstance(values[key], list) else factor * values[key] for key in keys}
    return change


def swapped(kind: str, one: str, other: str) -> collections.abc.Callable[[str, Values], Values]:
    return lambda line, values: values if line != kind else values | {one: values[other], other: values[one]}


def gyro_about_x(line: str, values: Values) -> Values:
    if line != "imu":
        return values
    x, y, z = values["angular_velocity_rad_s"]
    return values | {"angular_velocity_rad_s": [z, y, x]}


# Changes of the messages, each with the findings of the first drive that must report it.
SENT = {
    "odometry_reversed": (scaled("odometry", -1, "x_m", "y_m", "speed_m_s"), "odometry.speed_m_s is reversed"),
    "odometry_mm": (scaled("odometry", 1000, "x_m", "y_m", "speed_m_s"), "(odometry.speed_m_s): 10"),
    "yaw_reversed": (scaled("odometry", -1, "yaw_rad", "yaw_rate_rad_s"), "odometry.yaw_rad is reversed"),
    "yaw_degrees": (scaled("odometry", DEGREES, "yaw_rad", "yaw_rate_rad_s"), "odometry.yaw_rate_rad_s is in degrees"),
    "twist_swapped": (swapped("odometry", "speed_m_s", "yaw_rate_rad_s"), "it and odometry.yaw_rate_rad_s are swapped"),
    "xy_swapped": (swapped("odometry", "x_m", "y_m"), "odometry.x_m and odometry.y_m are swapped"),
    "y_reversed": (scaled("odometry", -1, "y_m"), "odometry.y_m is reversed"),
    "gyro_reversed": (scaled("imu", -1, "angular_velocity_rad_s"), "imu.angular_velocity_rad_s is reversed"),
    "gyro_degrees": (scaled("imu", DEGREES, "angular_velocity_rad_s"), "imu.angular_velocity_rad_s is in degrees"),
    "gyro_about_x": (gyro_about_x, "is measured about x"),
    "acceleration_g": (scaled("imu", 1 / 9.81, "linear_acceleration_m_s2"), "in g instead of"),
    "wheels_swapped": (swapped("wheels", "left_rad", "right_rad"), "left and right are swapped"),
    "wheels_degrees": (scaled("wheels", DEGREES, "left_rad", "right_rad"), "wheels is in degrees"),
    "left_wheel_reversed": (scaled("wheels", -1, "left_rad"), "wheels.left_rad is reversed"),
}
# Changes of obeyed commands.
OBEYED = {
    "forward_reversed": (lambda speed, turn: (-speed, turn), "command.speed_m_s is reversed"),
    "left_reversed": (lambda speed, turn: (speed, -turn), "command.yaw_rate_rad_s is reversed"),
    "command_swapped": (lambda speed, turn: (turn, speed), "command.speed_m_s and command.yaw_rate_rad_s are swapped"),
}
NAMED = {name: words for table in (SENT, OBEYED) for name, (_, words) in table.items()}


def sent(name: str | None, line: str, values: Values) -> Values:
    return SENT[name][0](line, values) if name in SENT else values


def obeyed(name: str | None, order: tuple[float, float]) -> tuple[float, float]:
    return OBEYED[name][0](*order) if name in OBEYED else order
