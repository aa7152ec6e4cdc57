"""The file to which the process of a solution writes the estimates that it showed, one line per image. The file outlives the process."""

import dataclasses
import json
import os

from .score import ScoredImage

INTERRUPTED = "stopped by Ctrl-C"
LINE_BYTES = 400  # a line is rewritten when the estimate of its image changes, so all lines have the same length
REFUSED_BYTES = 4000  # length of the first line, which reports refused calls …
REASON_LETTERS = 250  # … and has room for this many letters of the first reason, even if all are escaped


class Journal:
    """Writes to the file descriptor of an empty file."""

    def __init__(self, fd):
        self._fd, self._at, self._image = fd, -1, None
        self._refused = {"refused": 0, "first": ""}
        self._write_refused()

    def image(self, image):
        """Starts the line of the next image."""
        self._at += 1
        self._image = image
        self._write(dataclasses.asdict(image))

    def change(self, **fields):
        """Replaces the values of the latest image."""
        self._image = dataclasses.replace(self._image, **fields)
        self._write(dataclasses.asdict(self._image))

    def not_finite(self):
        """Counts an estimate that is ignored."""
        self.change(not_finite=self._image.not_finite + 1)

    def refused(self, reason):
        """Counts a call of HAL or WebGUI whose arguments were refused."""
        first = self._refused["first"] or (reason if len(reason) <= REASON_LETTERS else reason[:REASON_LETTERS - 1] + "…")
        self._refused = {"refused": self._refused["refused"] + 1, "first": first}
        self._write_refused()

    def end(self, error):
        """Records how the solution ended: the traceback of an exception, or None for a normal end."""
        self._at += 1
        self._write({"error": error})

    def _write(self, values):
        os.pwrite(self._fd, f"{json.dumps(values):<{LINE_BYTES - 1}}\n".encode(), REFUSED_BYTES + self._at * LINE_BYTES)

    def _write_refused(self):
        os.pwrite(self._fd, f"{json.dumps(self._refused):<{REFUSED_BYTES - 1}}\n".encode(), 0)


def read(file):
    """Returns (images, end of the solution as in Journal.end or None if its process ended first, number of refused calls and the first reason)."""
    file.seek(0)
    images, end, refused = [], None, {"refused": 0, "first": ""}
    for line in file:
        values = json.loads(line)
        if "error" in values:
            end = values
        elif "refused" in values:
            refused = values
        else:
            images.append(ScoredImage(**values))
    return images, end, (refused["refused"], refused["first"])
