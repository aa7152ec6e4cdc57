"""The file in which the process of a solution writes down what it showed, one line a picture: it outlives the process."""

import dataclasses
import json
import os

from .score import Picture

INTERRUPTED = "stopped by Ctrl-C"
LINE_BYTES = 400  # a line is written again when its picture's estimate changes, so all have one length
REFUSED_BYTES = 4000  # of the first line, on the calls that were refused …
REASON_LETTERS = 250  # … which holds so many of the first one's reason, however they are escaped


class Journal:
    """Writes to the file descriptor of an empty file."""

    def __init__(self, fd):
        self._fd, self._at, self._picture = fd, -1, None
        self._refused = {"refused": 0, "first": ""}
        self._write_refused()

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

    def refused(self, reason):
        """One more call of HAL or WebGUI whose arguments were refused."""
        first = self._refused["first"] or (reason if len(reason) <= REASON_LETTERS else reason[:REASON_LETTERS - 1] + "…")
        self._refused = {"refused": self._refused["refused"] + 1, "first": first}
        self._write_refused()

    def end(self, error):
        """How the solution ended: by an exception, with this traceback, or of its own accord (None)."""
        self._at += 1
        self._write({"error": error})

    def _write(self, values):
        os.pwrite(self._fd, f"{json.dumps(values):<{LINE_BYTES - 1}}\n".encode(), REFUSED_BYTES + self._at * LINE_BYTES)

    def _write_refused(self):
        os.pwrite(self._fd, f"{json.dumps(self._refused):<{REFUSED_BYTES - 1}}\n".encode(), 0)


def read(file):
    """(pictures, how the solution ended as in Journal.end, or None where its process ended first, how many calls were refused and why the first was)."""
    file.seek(0)
    pictures, end, refused = [], None, {"refused": 0, "first": ""}
    for line in file:
        values = json.loads(line)
        if "error" in values:
            end = values
        elif "refused" in values:
            refused = values
        else:
            pictures.append(Picture(**values))
    return pictures, end, (refused["refused"], refused["first"])
