#!/usr/bin/python3
"""What the linker and the compiler were asked for is in the programs: readelf (binutils) tells.

usage: hardening_test.py ON|OFF PROGRAM ...   ON: built as a user runs it, with canaries and checked copies
"""
import subprocess
import sys


def readelf(program, *flags):
    return subprocess.run(["readelf", "--wide", *flags, program], capture_output=True, text=True, check=True).stdout


def check(program, compiled):
    kind = next(line for line in readelf(program, "--file-header").splitlines() if "Type:" in line)
    assert "DYN" in kind, f"{program}: not position independent: {kind}"
    assert "GNU_RELRO" in readelf(program, "--program-headers"), f"{program}: no read-only relocations"
    assert "NOW" in readelf(program, "--dynamic"), f"{program}: relocations are resolved late"
    stack = next(line for line in readelf(program, "--program-headers").splitlines() if "GNU_STACK" in line)
    assert "RWE" not in stack, f"{program}: executable stack"
    if compiled:
        symbols = readelf(program, "--dyn-syms")
        assert "__stack_chk_fail" in symbols, f"{program}: no canaries on the stack"
        assert "_chk@" in symbols, f"{program}: no checked copies (_FORTIFY_SOURCE)"


for one in sys.argv[2:]:
    check(one, sys.argv[1] == "ON")
print("programs are hardened")
