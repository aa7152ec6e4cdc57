#!/usr/bin/python3
"""The Python of docs/howto/python.md runs, block after block in one folder.

usage: snippets_test.py SOURCE     (PYTHONPATH names the package)
"""
import os
import pathlib
import re
import sys
import tempfile

text = (pathlib.Path(sys.argv[1]) / "docs" / "howto" / "python.md").read_text()
blocks = re.findall(r"<!-- run -->\n```python\n(.*?)```", text, re.S)
assert len(blocks) == text.count("```python"), "every block of Python is run"
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    for block in blocks:
        names = {}
        exec(compile(block, "docs/howto/python.md", "exec"), names)  # noqa: S102
    assert names["end"]["finished"], names["end"]
    os.chdir("/")
