"""Ends a solution that computes on and on without asking a sensor."""

import contextlib
import signal
import threading
import time

from .robot import Stalled

TICK_S = 0.05


def _line_in(frame, path):
    """The line of the solution that a frame, or one that called it, stands in."""
    while frame is not None:
        if frame.f_code.co_filename == path:
            return f"line {frame.f_lineno}"
        frame = frame.f_back
    return "a library that it calls"


@contextlib.contextmanager
def limited(robot, path, stall_s):
    """Raises Stalled in the solution once no picture has come for `stall_s` of real time, and again until it ends: also where the
    solution catches everything. A solution whose time is over has a second. Only in the main thread, where signals arrive."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    seen, since = robot.passes, time.monotonic()

    def look(_signal, frame):
        nonlocal seen, since
        if robot.passes != seen:
            seen, since = robot.passes, time.monotonic()
        limit_s = min(stall_s, 1.0) if robot.finished else stall_s
        if time.monotonic() - since > limit_s:
            robot.stop()
            raise Stalled(f"the solution asked no sensor for {limit_s:g} s of real time ({_line_in(frame, path)}): the robot was stopped. "
                          "Ask HAL.getImage(), HAL.getOdom() or HAL.getLaserData() in each turn of a loop")

    before = signal.signal(signal.SIGALRM, look)
    signal.setitimer(signal.ITIMER_REAL, TICK_S, TICK_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
