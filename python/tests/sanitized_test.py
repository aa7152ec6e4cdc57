#!/usr/bin/python3
"""The interpreter runs under the address sanitizer, and the module was compiled for it: otherwise the other tests under it prove nothing.

usage: sanitized_test.py MODULE     (PYTHONPATH names the package)
"""
import ctypes
import os
import pathlib
import subprocess
import sys
import unittest

import numpy as np

MODULE = pathlib.Path(sys.argv.pop(1))

OVERRUN = """
import ctypes, numpy
array = numpy.empty(1000, numpy.uint8)
ctypes.memset(array.ctypes.data, 0, 1001)
"""


class Sanitized(unittest.TestCase):
    def test_the_runtime_is_loaded(self):
        self.assertTrue(hasattr(ctypes.CDLL(None), "__asan_init"))

    def test_the_module_asks_it(self):
        import waymark  # pylint: disable=import-outside-toplevel
        self.assertEqual(pathlib.Path(waymark._waymark.__file__).resolve(), MODULE.resolve())
        symbols = subprocess.run(["nm", "-D", "--undefined-only", MODULE], env={**os.environ, "LD_PRELOAD": ""}, check=True, capture_output=True, text=True).stdout
        self.assertIn("__asan_report_load8", symbols)
        self.assertIn("__ubsan_handle", symbols)

    def test_the_end_of_an_array_is_guarded(self):
        self.assertEqual(np.empty(1000, np.uint8).nbytes, 1000)
        done = subprocess.run([sys.executable, "-c", OVERRUN], check=False, capture_output=True, text=True)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("heap-buffer-overflow", done.stderr)


if __name__ == "__main__":
    unittest.main()
