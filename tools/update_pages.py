#!/usr/bin/python3
"""Regenerates the golden pages: tests/pages/*.txt, the texts of errors, warnings and reports (tests/support/golden_page.hpp).

usage: tools/update_pages.py BUILD_FOLDER [ctest options]

Runs the tests of the build folder (with -R or -L: only those), which write their texts instead of comparing them. All pages are replaced;
with options, entries of tests that did not run are kept. Review the difference as prose before it is committed.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/support"))
import golden_page  # noqa: E402


def parts_of(folder):
    """The texts that the tests wrote, as {page: {entry: text}}."""
    pages = {}
    for part in sorted(pathlib.Path(folder).iterdir()):
        page, entry, text = part.read_text(encoding="utf-8").split("\n", 2)
        pages.setdefault(page, {})[entry.removeprefix(golden_page.ENTRY)] = text
    return pages


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    build, options = sys.argv[1], sys.argv[2:]
    with tempfile.TemporaryDirectory(prefix="waymark-pages-") as out:
        tests = subprocess.run(["ctest", "--test-dir", build, "-j4", "--output-on-failure", *options],
                               env={**os.environ, "WAYMARK_PAGES_OUT": out}, check=False)
        pages = parts_of(out)
    for name, entries in sorted(pages.items()):
        page = golden_page.PAGES / f"{name}.txt"
        kept = golden_page.read_page(page) if options else {}
        merged = {**kept, **entries}
        page.parent.mkdir(exist_ok=True)
        page.write_text("".join(f"{golden_page.ENTRY}{entry}\n{merged[entry]}" for entry in sorted(merged)), encoding="utf-8")
        print(f"{page.relative_to(ROOT)}: {len(merged)} texts")
    return tests.returncode


if __name__ == "__main__":
    sys.exit(main())
