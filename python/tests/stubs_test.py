#!/usr/bin/python3
"""The type stubs and the reference are those of the module, and mypy finds what is wrong by them.

usage: stubs_test.py SOURCE     (PYTHONPATH names the package). mypy takes long: only with WAYMARK_FULL.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

RIGHT = """
import numpy as np
import waymark
from waymark import camera, geometry, tags

pose: geometry.SE3 = geometry.SE3.exp([0, 0, 1, 0, 0, 0]) @ geometry.SE3()
lens: camera.CameraModel = camera.pinhole(640, 480, 500, 500, 320, 240)
for detection in tags.Detector(max_hamming=1).detect(np.zeros((480, 640), np.uint8), lens):
    number: int = detection.id
"""
WRONG = {
    "geometry.SE2('a', 0, 0)": "call-overload",
    "camera.pinhole(640, 480)": "call-arg",
    "tags.Detector().detekt(1)": "attr-defined",
    "number: str = geometry.SE2(0, 0, 0).yaw": "assignment",
}


def mypy(**sources):
    """The output of mypy for some files, in one run, because reading NumPy's stubs takes most of the time."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [pathlib.Path(folder) / f"{name}.py" for name in sources]
        for path, source in zip(paths, sources.values()):
            path.write_text(source)
        environment = dict(os.environ, MYPYPATH=os.environ["PYTHONPATH"])
        done = subprocess.run([sys.executable, "-m", "mypy", "--cache-dir", folder, *map(str, paths)], capture_output=True, text=True, check=False,
                              env=environment)
        return done.stdout + done.stderr


def main():
    root = pathlib.Path(sys.argv[1])
    done = [subprocess.run([sys.executable, root / "tools" / tool, "--check"], check=False) for tool in ("update_python_stubs.py", "update_python_reference.py")]
    for tool in ("update_python_stubs.py", "update_python_reference.py"):  # a package of the system may be found
        without = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        run = subprocess.run([sys.executable, "-I", root / "tools" / tool, "--check"], check=False, capture_output=True, text=True, env=without)
        if "Traceback" in run.stderr or (run.returncode == 1 and "PYTHONPATH=build/check/python" not in run.stderr):
            print(f"{tool} without the package printed: {run.stderr}")
            return 1
    if any(run.returncode != 0 for run in done):
        return 1
    if "WAYMARK_FULL" not in os.environ:
        return 0
    everything = "from waymark import camera, geometry, tags\n" + "\n".join(WRONG) + "\n"
    found = mypy(right=RIGHT, program=everything)
    if not found or any("program.py:" not in line and ": error:" in line for line in found.splitlines()):
        print(found)
        return 1
    for number, code in enumerate(WRONG.values(), start=2):
        if not any(f"program.py:{number}:" in line and f"[{code}]" in line for line in found.splitlines()):
            print(f"line {number} should be [{code}]:\n{everything}\n{found}")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
