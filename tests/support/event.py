"""Waits for conditions with a deadline: a fixed pause is too short on a busy machine, and too long on any other."""
import fcntl
import pathlib
import re
import select
import struct
import termios
import threading
import time


def until(condition, what: str, seconds: float = 30):
    """Waits until `condition()` is true, and returns its value."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"after {seconds:.0f} s: {what() if callable(what) else what}")
        time.sleep(0.01)
    return value


def until_it_catches(process, number):
    """Waits until a process has a handler for a signal; without one the signal ends it."""
    def handled():
        caught = re.search(r"^SigCgt:\s*(\w+)$", pathlib.Path(f"/proc/{process.pid}/status").read_text(), re.M).group(1)
        return int(caught, 16) >> (number - 1) & 1
    until(handled, f"signal {number} is not handled")


def until_taken(process, number):
    """Waits until a signal sent to a process is no longer pending: its handler runs, or the process has ended."""
    def pending():
        status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
        return any(int(mask, 16) >> (number - 1) & 1 for mask in re.findall(r"^(?:Sig|Shd)Pnd:\s*(\w+)$", status, re.M))
    until(lambda: not pending(), f"signal {number} is pending")


def until_full(pipe):
    """Waits until the writer of a pipe without a reader blocks: the pipe is nearly full and does not change for a while."""
    def unread():
        return struct.unpack("i", fcntl.ioctl(pipe, termios.FIONREAD, b"\0" * 4))[0]

    def stuck():
        before = unread()
        time.sleep(0.3)
        return unread() == before > fcntl.fcntl(pipe, fcntl.F_GETPIPE_SZ) - 2 * select.PIPE_BUF
    until(stuck, lambda: f"{unread()} bytes in the pipe")


class Lines:
    """Collects the output of a process from a pipe in a thread. Nothing else may read the pipe."""

    def __init__(self, stream):
        self._lines = []
        self._thread = threading.Thread(target=lambda: self._lines.extend(stream), daemon=True)
        self._thread.start()

    @property
    def text(self) -> str:
        return "".join(self._lines.copy())

    def wait_for(self, *texts: str, seconds: float = 30):
        """Waits until all texts were written."""
        until(lambda: all(text in self.text for text in texts), lambda: f"{texts} in: {self.text}", seconds)

    def wait_for_number(self, pattern: str, accepts, count: int = 1, seconds: float = 30):
        """Waits until `count` matches of a pattern with one group are numbers that `accepts`."""
        until(lambda: sum(map(accepts, map(float, re.findall(pattern, self.text, re.M)))) >= count, lambda: f"{count} of {pattern} in: {self.text}", seconds)

    def rest(self, seconds: float = 30) -> str:
        """The whole output, after the process has closed the pipe."""
        self._thread.join(seconds)
        assert not self._thread.is_alive(), "the pipe is still open"
        return self.text
