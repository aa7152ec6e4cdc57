#!/usr/bin/python3
"""Cameras by Linux' own driver and gamepads by its uinput, in a machine that has them (machine.py).

usage: devices_test.py PROGRAM FOLDER [TestClass.test]"""
import pathlib
import shlex
import sys

import machine

MOST_S = 900


def main() -> int:
    program, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    if packages := machine.missing():
        print(f"devices_test.py: not installed: {' '.join(packages)}", file=sys.stderr)
        return 1
    sources = pathlib.Path(__file__).resolve().parents[2]
    guest = shlex.join(["/usr/bin/python3", str(sources / "tests/devices/guest_test.py"), str(program), str(sources), *sys.argv[3:]])
    code, said = machine.boot(folder, guest, MOST_S)
    print(said[said.find("machine: started"):])
    if code is None:
        print(f"devices_test.py: the machine did not end within {MOST_S} s", file=sys.stderr)
    return 1 if code is None else code


if __name__ == "__main__":
    sys.exit(main())
