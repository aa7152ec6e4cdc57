"""The checks of lab 11, faults, watchdogs and safety. Do the lab before reading them."""
import math

import numpy as np

from . import Wrong, number, several, truth


def expired(mine):
    for fed, now, right in ((None, 0.0, True), (None, 5.0, True), (1.0, 1.0, False), (1.0, 1.2, False), (1.0, 1.26, True), (1.0, 9.0, True), (0.0, 0.1, False), (5.0, 1.0, True)):
        if truth(mine.expired(fed, now)) != right:
            return f"a wrong decision for a watchdog that was {'never fed' if fed is None else f'fed at {fed} s'} and is queried at {now} s"


def way(speed_m_s, delay_s, brake_m_s2):
    return speed_m_s * delay_s + speed_m_s * speed_m_s / (2 * brake_m_s2)


def stopping(mine):
    for v, d, b in ((0.5, 0.0, 1.0), (0.5, 0.3, 1.0), (2.0, 0.1, 4.0), (0.0, 0.3, 1.0)):
        found = number(mine.stopping_m(v, d, b))
        if not np.isclose(found, way(v, d, b)):
            return f"at {v} m/s, {d} s late, with {b} m/s² it moves {'less far than' if found > way(v, d, b) else 'farther than'} {found:.3f} m: " + \
                ("how fast is it in the middle of braking?" if d == 0 else "what does it do until it notices?")


def fastest(mine):
    for gap, d, b in ((0.5, 0.0, 1.0), (0.5, 0.3, 1.0), (2.0, 0.1, 4.0)):
        v = number(mine.fastest_m_s(gap, d, b))
        if v < 0:
            return f"{v:.3f} m/s is backwards: the equation has another root"
        if not np.isclose(way(v, d, b), gap):
            return f"at {v:.3f} m/s the robot {'does not stop' if way(v, d, b) > gap else 'stops much too early'} within {gap} m, {d} s late and with {b} m/s²"
    for gap in (0.0, -0.2):
        if not np.isclose(number(mine.fastest_m_s(gap, 0.3, 1.0)), 0):
            return f"wrong for a gap of {gap} m"


def limited(mine):
    for v, w in ((math.nan, 0.1), (0.1, math.nan), (math.inf, 0.0), (0.1, -math.inf)):
        try:
            sent = [number(part) for part in several(mine.limited(v, w, 0.5, 1.0), 2)]
        except Wrong as words:
            return f"for ({v}, {w}): {words}"
        if sent != [0, 0]:
            return f"({v}, {w}) is not a valid command: ({sent[0]:g}, {sent[1]:g}) must not be sent"
    for v, w in ((0.3, 0.5), (1.0, 0.5), (0.3, 4.0), (-1.0, -0.5), (-2.0, 3.0), (0.0, -2.0), (0.0, 0.0)):
        found = [number(part) for part in several(mine.limited(v, w, 0.5, 1.0), 2)]
        became = f"({v}, {w}) becomes ({found[0]:.2f}, {found[1]:.2f})"
        if abs(found[0]) > 0.5 + 1e-9 or abs(found[1]) > 1.0 + 1e-9:
            return f"{became}, which exceeds the limits"
        if not np.isclose(found[0] * w, found[1] * v):
            return f"{became}: that is a different arc"
        if not np.allclose(found, np.array([v, w]) / max(1, abs(v) / 0.5, abs(w))):
            return f"{became}: slower than necessary, or backwards"


def reaction(mine):
    t = np.arange(0, 10, 0.1)
    for speeds, right in ((np.where(t < 5.55, 0.3, 0), 0.6), (np.where((t < 5.55) & ~((t > 5.05) & (t < 5.35)), 0.3, 0), 0.6), (np.where(t < 3, 0.3, 0), 0.0),
                          (np.full(100, 0.3), None), (np.where((t < 5.55) | (t > 8), 0.3, 0), None), (np.where(t < 5.55, -0.3, 0), 0.6), (np.zeros(100), 0.0)):
        found = mine.reaction_s(t.copy(), speeds.copy(), 5.0)
        if found is None and right is not None:
            return "the robot is stationary at the end, but None means that it never stopped"
        if found is not None and not np.isfinite(number(found)):
            return "it is not a number"
        if found is not None and right is None:
            return "a robot that drives at the end never stopped"
        if right is not None and not np.isclose(number(found), right):
            return f"it returns {number(found):.1f} s, but the robot " + ("moved after that: is a pause a stop, is backwards?" if number(found) < right else "stopped before that")
    found = mine.reaction_s(mine.driven[:, 0], mine.driven[:, 1], mine.BLIND_S)
    if found is None or not 0 < number(found) < 3:
        return f"Waymark's robot stopped within three seconds, but it returns {found}"
    print(f"      the camera failed at {mine.BLIND_S} s; the robot was commanded to stop after {found:.2f} s: {next(r for r in reversed(mine.reasons) if r)}")


CHECKS = [("the watchdog", 2, expired), ("stopping distance", 1, stopping), ("the fastest speed", 2, fastest), ("the limiter", 3, limited), ("the reaction", 2, reaction)]
