#!/usr/bin/python3
"""Completes cmake/public_headers.txt, the list of headers that are installed.

The first part of the list is maintained by hand: the headers for other programs. This tool writes the second part: headers that
those include, directly or indirectly. Rooms that are not installed (INTERNAL) cannot have public headers, and a program built
with the installed package (tests/consumer) may include only headers of the first part.

usage: tools/update_public_headers.py [--check] [ROOT]     --check: change nothing, exit code 1 if the list is out of date
"""
import pathlib
import re
import sys

INCLUDE = re.compile(r'^[ \t]*#\s*include\s*[<"](waymark/[^>"]+)[>"]', re.M)
BEGIN = "# Included by those above (written by tools/update_public_headers.py):\n"


def includes_of(path):
    return INCLUDE.findall(path.read_text(encoding="utf-8", errors="replace"))


def closure(root, doors):
    """The headers that the doors include and that are not doors, sorted; check() reports missing files."""
    seen, todo = set(doors), list(doors)
    while todo:
        path = root / todo.pop()
        if not path.exists():
            continue
        for header in includes_of(path):
            if header not in seen:
                seen.add(header)
                todo.append(header)
    return sorted(seen - set(doors))


def is_internal(root, header):
    if re.match(r"waymark/app/(live|cli|commission|doctor|robot|session|teach|view)/", header):
        return True
    folder = (root / header).parent
    while folder != root and not (folder / "CMakeLists.txt").exists():
        folder = folder.parent
    lists = folder / "CMakeLists.txt"
    return lists.exists() and re.search(r"waymark_room\(\s*[\w/]+\s+INTERNAL", lists.read_text(encoding="utf-8")) is not None


def consumer_sources(root):
    """The sources that tests/consumer builds: its own and some examples."""
    folder = root / "tests/consumer"
    examples = re.search(r"set\(examples ([^)]*)\)", (folder / "CMakeLists.txt").read_text(encoding="utf-8"))
    return [*sorted(folder.glob("*.cpp")), *(root / "examples" / f"{name}.cpp" for name in examples[1].split())]


def problems_of(root, doors, rest):
    for header in doors:
        if not (root / header).exists():
            yield f"cmake/public_headers.txt: there is no {header}"
    for header in sorted({*doors, *rest}):
        if is_internal(root, header):
            yield f"cmake/public_headers.txt: {header} is public, or included by one that is, but its room is not installed"
    for path in consumer_sources(root):
        for header in includes_of(path):
            if header not in doors:
                yield f"{path.relative_to(root)}: includes {header}, which is not public: put it into the first part of cmake/public_headers.txt"


def main():
    words = [word for word in sys.argv[1:] if word != "--check"]
    root = pathlib.Path(words[0]) if words else pathlib.Path(__file__).resolve().parent.parent
    page = root / "cmake/public_headers.txt"
    text = page.read_text(encoding="utf-8")
    head, _, tail = text.partition(BEGIN)
    doors = [line for line in head.splitlines() if line and not line.startswith("#")]
    rest = closure(root, doors)
    problems = list(problems_of(root, doors, rest))
    if "--check" in sys.argv[1:]:
        listed = tail.split()
        problems += [f"cmake/public_headers.txt: {header} is missing; run tools/update_public_headers.py" for header in rest if header not in listed]
        problems += [f"cmake/public_headers.txt: nothing public includes {header}; run tools/update_public_headers.py"
                     for header in listed if header not in rest]
    else:
        page.write_text(head + BEGIN + "".join(f"{header}\n" for header in rest), encoding="utf-8")
    print("\n".join(problems) if problems else f"{len(doors)} headers for other programs, {len(rest)} that they include")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
