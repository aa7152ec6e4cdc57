#!/usr/bin/python3
"""Packs a built Python package as a wheel, with setuptools and without a network.

usage: tools/build_wheel.py BUILD_FOLDER OUTPUT_FOLDER     e.g. tools/build_wheel.py build/release wheels
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SETUP = """
from setuptools import Distribution, setup


class Built(Distribution):
    def has_ext_modules(self):
        return True


setup(name="waymark", version="{version}", description="Teach a robot a route once and repeat it, from AprilTags", license="BSD-3-Clause",
      packages=["waymark", "waymark.academy", "waymark.labs"], package_data={{"waymark": ["*.so", "*.pyi", "py.typed", "share/**/*"]}},
      python_requires=">=3.10", install_requires=["numpy"], distclass=Built)
"""


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    package, output = pathlib.Path(sys.argv[1]) / "python" / "waymark", pathlib.Path(sys.argv[2]).resolve()
    if not list(package.glob("_waymark*.so")):
        print(f"{package}: no built module there. Build with -DWAYMARK_PYTHON=ON.", file=sys.stderr)
        return 1
    version = re.search(r"project\(Waymark VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    with tempfile.TemporaryDirectory() as folder:
        staged = pathlib.Path(folder)
        shutil.copytree(package, staged / "waymark", ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copytree(ROOT / "share", staged / "waymark" / "share")
        shutil.copy(ROOT / "LICENSE", staged)
        (staged / "setup.py").write_text(SETUP.format(version=version))
        done = subprocess.run([sys.executable, "setup.py", "-q", "bdist_wheel", "-d", output], cwd=staged, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(done.stdout, done.stderr, file=sys.stderr)
        return 1
    print(*sorted(str(path) for path in output.glob("waymark-*.whl")), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
