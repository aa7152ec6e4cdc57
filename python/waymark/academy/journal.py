"""The file in which the process of a solution writes down what it showed, one line a picture: it outlives the process."""

import dataclasses
import json
import os

from .score import Picture

INTERRUPTED = "stopped by Ctrl-C"
LINE_BYTES = 400  # a line is written again when its picture's estimate changes, so all have one length


class Journal:
    """Writes to the file descriptor of an empty file."""

    def __init__(self, fd):
        self._fd, self._at, self._picture = fd, -1, None

    def picture(self, picture):
        """The next picture."""
        self._at += 1
        self._picture = picture
        self._write(dataclasses.asdict(picture))

    def change(self, **fields):
        """Other values of the newest picture."""
        self._picture = dataclasses.replace(self._picture, **fields)
        self._write(dataclasses.asdict(self._picture))

    def not_finite(self):
        """One more estimate that does not count."""
        self.change(not_finite=self._picture.not_finite + 1)

    def end(self, error, early):
        """How the solution ended: `error` the traceback of an exception or None; `early`, of its own accord, before its time was over."""
        self._at += 1
        self._write({"error": error, "early": early})

    def _write(self, values):
        os.pwrite(self._fd, f"{json.dumps(values):<{LINE_BYTES - 1}}\n".encode(), self._at * LINE_BYTES)


def read(file):
    """(pictures, how the solution ended as in Journal.end, or None where its process ended first)."""
    file.seek(0)
    pictures, end = [], None
    for line in file:
        values = json.loads(line)
        if "error" in values:
            end = values
        else:
            pictures.append(Picture(**values))
    return pictures, end
