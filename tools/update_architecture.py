#!/usr/bin/python3
"""Writes the table of rooms in docs/architecture.md: the contents of each (the first sentence of its README) and the rooms that it may use
(cmake/rooms.txt).

usage: tools/update_architecture.py [--check]     --check: change nothing, exit code 1 if the table is out of date
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/architecture.md"
BEGIN, END = "<!-- rooms: tools/update_architecture.py -->\n", "<!-- end of rooms -->\n"


def rooms():
    """(name, rooms it may use) of every row of the table, in order: a room uses only those above it."""
    for line in (ROOT / "cmake/rooms.txt").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            name, uses = [cell.strip() for cell in line.split("|")[:2]]
            yield name, uses


def first_sentence(readme):
    """The text of a README up to its first full stop, without title and line breaks."""
    paragraph = readme.split("\n", 1)[1].strip().split("\n\n", 1)[0]
    text = " ".join(paragraph.split())
    return re.match(r"(.*?)(\.(?= [A-Z`])|\.?$)", text)[1]


def table():
    lines = ["| room | what it holds | may use, with what that uses |\n", "|---|---|---|\n"]
    for name, uses in rooms():
        readme = ROOT / "waymark" / name / "README.md"
        if readme.exists():
            lines.append(f"| [{name}](../waymark/{name}/README.md) | {first_sentence(readme.read_text(encoding='utf-8'))} | "
                         f"{'everything' if uses == '*' else uses} |\n")
    return "".join(lines)


def main():
    page = PAGE.read_text(encoding="utf-8")
    head, rest = page.split(BEGIN)
    written = head + BEGIN + table() + END + rest.split(END)[1]
    if written == page:
        return 0
    if "--check" in sys.argv[1:]:
        print("docs/architecture.md: the table of rooms is out of date; run tools/update_architecture.py")
        return 1
    PAGE.write_text(written, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
