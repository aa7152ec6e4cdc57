"""Numbers shared by programs on one machine (domains of ROS 2, ports): each test claims its own, so that tests can run concurrently."""
import fcntl
import os
import pathlib
import tempfile

KEPT = []  # locks, released when the process ends


def claim(what, first, count):
    """A number in [first, first + count) that no other process has until this one ends; each call returns another one."""
    for offset in range(count):
        number = first + (os.getpid() + offset) % count
        path = pathlib.Path(tempfile.gettempdir()) / f"waymark-{what}-{number}.lock"
        try:
            lock = open(path, "w", encoding="ascii")
        except PermissionError:  # another user's
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        KEPT.append(lock)
        return number
    raise RuntimeError(f"no {what} between {first} and {first + count - 1} is free")


def domain():
    """A domain of ROS 2."""
    return claim("ros-domain", 1, 199)


def lcm_port():
    return claim("lcm-port", 20000, 40000)
