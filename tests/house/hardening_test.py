#!/usr/bin/python3
"""The hardening options of linker and compiler are effective in the programs; checked with readelf (binutils).

usage: hardening_test.py ON|OFF PROGRAM ...   ON: built as a user runs it, with canaries and checked copies
"""
import pathlib
import re
import subprocess
import sys

# Valid targets of indirect jumps and calls: endbr64 (CET), paciasp (BTI and PAC). The linker marks a program only if the start files of the C
# library are built with the same options. Those of Debian 12 are not, but the instructions exist in the code.
LANDINGS = {"X86-64": b"\xf3\x0f\x1e\xfa", "AArch64": b"\x3f\x23\x03\xd5"}
FEWEST_LANDINGS = 10


def readelf(program, *flags):
    return subprocess.run(["readelf", "--wide", *flags, program], capture_output=True, text=True, check=True).stdout


def landings(program):
    """Number of jump targets in the code; None for an architecture without such an instruction."""
    machine = re.search(r"Machine:.*?(X86-64|AArch64)", readelf(program, "--file-header"))
    if machine is None:
        return None
    offset, size = re.search(r"\.text +PROGBITS +[0-9a-f]+ ([0-9a-f]+) ([0-9a-f]+)", readelf(program, "--sections")).groups()
    return pathlib.Path(program).read_bytes()[int(offset, 16):int(offset, 16) + int(size, 16)].count(LANDINGS[machine.group(1)])


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
        found = landings(program)
        assert found is None or found >= FEWEST_LANDINGS, f"{program}: only {found} landings for jumps (-fcf-protection, -mbranch-protection)"


programs, built_for_users = sys.argv[2:], sys.argv[1] == "ON"
for one in programs:
    check(one, built_for_users)
# All are compiled with the same flags; a small program may have no copy with a run-time length.
if built_for_users and not any("_chk@" in readelf(one, "--dyn-syms") for one in programs):
    sys.exit(f"{', '.join(programs)}: no checked copies (_FORTIFY_SOURCE)")
print("programs are hardened")
