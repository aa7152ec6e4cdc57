#!/usr/bin/python3
"""The site with the pages that work in the browser, and the words that stand there without them.

usage: site_test.py OUTPUT_FOLDER
Runs with WAYMARK_FULL only, since it may compile the pages; exit code 77 (skipped) without it, without MkDocs or without emscripten.
"""
import os
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
SKIPPED = 77


def build(folder, *words):
    return subprocess.run([sys.executable, ROOT / "tools/build_site.py", folder, *words], check=False).returncode


def main():
    output = pathlib.Path(sys.argv[1])
    if not os.environ.get("WAYMARK_FULL") or shutil.which("emcmake") is None:
        print("only with WAYMARK_FULL, and with emscripten installed")
        return SKIPPED
    for folder, words, there in (("with", [], True), ("without", ["--without-interactive"], False)):
        shutil.rmtree(output / folder, ignore_errors=True)
        outcome = build(output / folder, *words)
        if outcome != 0:
            return outcome
        page = (output / folder / "interactive/index.html").read_text()
        assert ("../pages/detect.html" in page) == there, f"{folder}: links to the pages"
        assert ("not in this copy of the site" in page) != there, f"{folder}: words on missing pages"
        for name in ("detect.html", "two_poses.html", "waymark.js", "page.css", "notices.txt"):
            assert (output / folder / "pages" / name).exists() == there, f"{folder}: {name}"
    return 0


if __name__ == "__main__":
    sys.exit(main())
