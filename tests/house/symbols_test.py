#!/usr/bin/python3
"""The public functions of a released version still exist: tests/golden/VERSION/symbols.txt, for versions with the same
minor number, between which a program need not change (cmake/Package.cmake: SameMinorVersion).

usage: symbols_test.py BUILD_FOLDER; exit code 77: no version has been released yet
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import list_symbols  # noqa: E402


def missing(kept, now):
    """Promised signatures that are missing."""
    return sorted(set(kept) - set(now))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    assert missing(["a(int)", "b()"], ["b()", "c()"]) == ["a(int)"], "the comparison finds nothing"
    if not any(path.is_dir() for path in (ROOT / "tests/golden").iterdir()):
        print("tests/golden holds no released version")
        sys.exit(77)
    minor = re.search(r"project\(Waymark VERSION ([0-9]+\.[0-9]+)\.", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
    folders = sorted((ROOT / "tests/golden").glob(f"{minor}.*/symbols.txt"))
    if not folders:
        sys.exit(f"tests/golden has no {minor}.*/symbols.txt: write one with tools/list_symbols.py")
    now = list_symbols.symbols(sys.argv[1])
    for path in folders:
        kept = path.read_text(encoding="utf-8").splitlines()
        gone = missing(kept, now)
        if gone:
            print(f"Functions of {path.parent.name} that are gone or have other arguments:", *gone, sep="\n  ")
            sys.exit("A program that was compiled for that version no longer builds. Keep them beside the new ones; before the release of "
                     f"{path.parent.name} itself: tools/list_symbols.py BUILD_FOLDER > {path.relative_to(ROOT)}, and a line in CHANGELOG.md.")
        print(f"{path.parent.name}: all {len(kept)} functions are there")


if __name__ == "__main__":
    main()
