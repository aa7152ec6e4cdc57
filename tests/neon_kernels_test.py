#!/usr/bin/env python3
"""The NEON kernels give the same results as the portable ones: plane_kernels_test.cpp and components_test.cpp, compiled for 64-bit ARM by
Debian's cross compiler and run by qemu-user. Only the tested code is compiled. Runs only with WAYMARK_FULL.

usage: neon_kernels_test.py SOURCE_FOLDER
"""
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "support"))
import installed  # noqa: E402

SKIPPED = 77
COMPILER, EMULATOR = "aarch64-linux-gnu-g++", "qemu-aarch64"
GTEST = pathlib.Path("/usr/src/googletest/googletest")  # of Debian's package googletest
DETECTOR = ["plane_kernels.cpp", "plane_kernels_neon.cpp", "components.cpp", "plane_kernels_test.cpp", "components_test.cpp"]


def main():
    source = pathlib.Path(sys.argv[1]).resolve()
    if not os.environ.get("WAYMARK_FULL"):
        print("skipped: WAYMARK_FULL is not set")
        return SKIPPED
    installed.program(COMPILER, "g++-aarch64-linux-gnu")
    installed.program(EMULATOR, "qemu-user")
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder) / "neon_kernels"
        words = [COMPILER, "-std=c++20", "-O2", "-static", f"-I{source}", f"-I{GTEST}", f"-I{GTEST}/include",
                 f"{GTEST}/src/gtest-all.cc", f"{GTEST}/src/gtest_main.cc", str(source / "waymark/base/random.cpp")]
        words += [str(source / "waymark/tags/detector" / name) for name in DETECTOR] + ["-o", str(program)]
        subprocess.run(words, check=True)
        done = subprocess.run([EMULATOR, str(program)], capture_output=True, text=True)
        print(done.stdout, done.stderr)
        if done.returncode != 0:
            return 1
        if "NEON is among the kernels" not in done.stdout:
            print("the kernels for NEON did not run")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
