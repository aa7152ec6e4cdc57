#!/usr/bin/python3
"""No variadic function gets an argument narrower than it reads: the upper half of an int on the stack is not set.

The compiler checks printf and similar functions (-Wformat). These rules are for calls that it does not check: syscall() is called through
kernel_call() of tests/fake_v4l2; numbers for prctl() are cast to unsigned long; execl() ends with a null pointer, not with 0 or NULL.
"""
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
ALLOWED = "tests/fake_v4l2/kernel_call.hpp"
RULES = (
    (re.compile(r"\bsyscall\s*\([^),]*,"), "call kernel_call() of tests/fake_v4l2/kernel_call.hpp"),
    (re.compile(r"\bprctl\s*\(\s*(?!PR_SET_NAME)\w+\s*,(?!\s*static_cast<unsigned long>)"), "cast the number to unsigned long"),
    (re.compile(r"\bexecl[pe]?\s*\([^;]*,\s*(?:0|NULL)\s*\)"), "end the list with static_cast<char*>(nullptr)"),
)


def violations(name, text):
    return [f"{name}:{text.count(chr(10), 0, match.start()) + 1}: {match.group(0)}: {advice}" for rule, advice in RULES for match in rule.finditer(text)]


class VariadicCalls(unittest.TestCase):
    def test_no_source_passes_a_narrow_argument(self):
        listed = subprocess.run(["git", "ls-files", "*.cpp", "*.hpp", "*.c", "*.h"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
        self.assertGreater(len(listed), 500)
        found = [line for name in listed if name != ALLOWED for line in violations(name, (ROOT / name).read_text())]
        self.assertEqual(found, [])

    def test_planted_violations_are_found(self):
        for planted in ("syscall(SYS_mmap, nullptr, size, 3, 1, memory, 0)", "prctl(PR_SET_PDEATHSIG, SIGKILL)", 'execlp("sh", "sh", NULL)'):
            self.assertEqual(len(violations("planted.cpp", f"  (void)::{planted};\n")), 1, planted)

    def test_correct_calls_pass(self):
        for right in ("syscall(SYS_gettid)", "prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(SIGKILL))", 'prctl(PR_SET_NAME, "name")',
                      'execlp("sh", "sh", static_cast<char*>(nullptr))'):
            self.assertEqual(violations("right.cpp", f"  (void)::{right};\n"), [], right)


if __name__ == "__main__":
    unittest.main()
