import math

import numpy as np


def expired(fed_s, now_s):
    return fed_s is None or not 0 <= now_s - fed_s <= 0.25


def stopping_m(speed_m_s, delay_s, brake_m_s2):
    return speed_m_s * delay_s + speed_m_s**2 / (2 * brake_m_s2)


def fastest_m_s(gap_m, delay_s, brake_m_s2):
    lost = brake_m_s2 * delay_s
    return math.sqrt(lost**2 + 2 * brake_m_s2 * gap_m) - lost if gap_m > 0 else 0.0


def limited(speed_m_s, yaw_rate_rad_s, most_m_s, most_rad_s):
    if not (math.isfinite(speed_m_s) and math.isfinite(yaw_rate_rad_s)):
        return 0.0, 0.0
    factor = 1 / max(1, abs(speed_m_s) / most_m_s, abs(yaw_rate_rad_s) / most_rad_s)
    return factor * speed_m_s, factor * yaw_rate_rad_s


def reaction_s(times_s, speeds_m_s, fault_s):
    moving = np.flatnonzero(speeds_m_s != 0)
    if len(moving) == 0:
        return 0.0
    if moving[-1] == len(times_s) - 1:
        return None
    return max(0.0, times_s[moving[-1] + 1] - fault_s)


WRONG = {
    "first command not awaited": ("fed_s is None or not 0 <= now_s - fed_s <= 0.25", "fed_s is not None and not 0 <= now_s - fed_s <= 0.25", "a wrong decision for a watchdog that was never fed and is"),
    "zero taken for never": ("fed_s is None or", "not fed_s or", "a wrong decision for a watchdog that was fed at"),
    "clock set back": ("not 0 <= now_s - fed_s <= 0.25", "now_s - fed_s > 0.25", "a wrong decision for a watchdog that was fed at"),
    "delay forgotten": ("speed_m_s * delay_s + ", "", "m/s² it moves farther than"),
    "braking without getting slower": ("speed_m_s**2 / (2 * brake_m_s2)", "speed_m_s**2 / brake_m_s2", "m/s² it moves less far than"),
    "the other root": ("math.sqrt(lost**2 + 2 * brake_m_s2 * gap_m) - lost", "-math.sqrt(lost**2 + 2 * brake_m_s2 * gap_m) - lost", "m/s is backwards: the equation has another root"),
    "speed without the delay": ("math.sqrt(lost**2 + 2 * brake_m_s2 * gap_m) - lost", "math.sqrt(2 * brake_m_s2 * gap_m)", "m/s the robot does not stop within"),
    "not a number passed on": ("    if not (math.isfinite(speed_m_s) and math.isfinite(yaw_rate_rad_s)):\n        return 0.0, 0.0\n", "", "the result contains NaN or infinity: a division by"),
    "yaw rate not looked at": ("(math.isfinite(speed_m_s) and math.isfinite(yaw_rate_rad_s))", "math.isfinite(speed_m_s)", "the result contains NaN or infinity: a division by"),
    "each limited for itself": ("return factor * speed_m_s, factor * yaw_rate_rad_s", "return max(-most_m_s, min(most_m_s, speed_m_s)), max(-most_rad_s, min(most_rad_s, yaw_rate_rad_s))", "that is a different arc"),
    "backwards without limit": ("abs(speed_m_s) / most_m_s", "speed_m_s / most_m_s", "which exceeds the limits"),
    "a pause for a stop": ("times_s[moving[-1] + 1] - fault_s)", "times_s[(times_s >= fault_s) & (speeds_m_s == 0)][0] - fault_s)", "s, but the robot moved after that: is a pause a stop, is"),
    "forwards only": ("speeds_m_s != 0", "speeds_m_s > 0", "s, but the robot moved after that: is a pause a stop, is"),
    "never for good": ("    if moving[-1] == len(times_s) - 1:\n        return None\n", "    moving = moving[:-1] if moving[-1] == len(times_s) - 1 else moving\n", "a robot that drives at the end never stopped"),
}
