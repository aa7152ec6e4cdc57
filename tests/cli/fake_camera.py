"""A folder for tests/fake_v4l2: cameras that play images, for programs that are started with `environment()`."""
import functools
import os
import pathlib
import shutil
import tempfile

PRELOAD = "tests/fake_v4l2/libwaymark_fake_v4l2_preload.so"


KEPT = []  # folders that are removed after all tests


@functools.cache
def preload_of(program):
    """The library in the build folder of a program, or a copy of it if the path has a space, at which LD_PRELOAD is split."""
    library = pathlib.Path(program).resolve().parents[1] / PRELOAD
    if " " not in str(library):
        return library
    KEPT.append(tempfile.TemporaryDirectory(prefix="waymark-preload-"))
    return pathlib.Path(shutil.copy(library, KEPT[-1].name))


class FakeCamera:
    """`folder` will hold dev/video0 and the frames."""

    def __init__(self, folder, program, number=0):
        self.folder, self.program, self.number = pathlib.Path(folder), program, number
        self.lines = ["card Fake camera"]
        (self.folder / "dev/v4l/by-id").mkdir(parents=True, exist_ok=True)
        link = self.folder / f"dev/v4l/by-id/usb-Fake_camera_{number}-video-index0"
        link.symlink_to(f"../../video{number}")

    def play(self, images, rate_hz=30, fourcc="GREY"):
        """Plays grey images (lists of rows) as GREY or YUYV."""
        height, width = len(images[0]), len(images[0][0])
        name = f"frames{self.number}_{len(self.lines)}"
        with open(self.folder / name, "wb") as file:
            for rows in images:
                for row in rows:
                    file.write(bytes(row) if fourcc == "GREY" else b"".join(bytes((value, 128)) for value in row))
        return self.add_mode(fourcc, width, height, rate_hz, name)

    def add_mode(self, fourcc, width, height, rate_hz, name):
        self.lines.append(f"mode {fourcc} {width} {height} {rate_hz} {name}")
        self.plug_in()
        return self

    def plug_in(self):
        (self.folder / f"dev/video{self.number}").write_text("\n".join(self.lines) + "\n")

    def unplug(self):
        (self.folder / f"dev/video{self.number}").unlink()

    def environment(self, faults=""):
        return {**os.environ, "LD_PRELOAD": str(preload_of(self.program)), "FAKE_V4L2": str(self.folder), "FAKE_V4L2_FAULTS": faults,
                "ASAN_OPTIONS": "verify_asan_link_order=0:" + os.environ.get("ASAN_OPTIONS", "")}
