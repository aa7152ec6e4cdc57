#!/usr/bin/python3
"""Copies the quoted lines of examples/ into the documents, so that documents show the code that is built.

A document marks the place with "<!-- quote: FILE -->" before a fenced block; a file marks its lines with "// [quoted by DOCUMENT]" and
"// [end]". Several parts of one file have names: "<!-- quote: FILE, PART -->", "// [quoted by DOCUMENT, PART]". Marks inside a quotation
are omitted from it.

usage: tools/update_quotes.py [--check]     --check: change nothing, exit code 1 if a quotation is out of date
"""
import pathlib
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent
PLACE = re.compile(r"(<!-- quote: (\S+?)(, \w+)? -->\n```\w+\n).*?^```", re.M | re.S)


def quoted(source, document, part):
    text = (ROOT / source).read_text(encoding="utf-8")
    match = re.search(rf"^ *// \[quoted by {re.escape(document + part)}\]\n(.*?)^ *// \[end\]", text, re.M | re.S)
    if not match:
        sys.exit(f"{source}: has no lines '// [quoted by {document}{part}]' to '// [end]'")
    return textwrap.dedent(re.sub(r"^ *// \[quoted by .*\]\n", "", match[1], flags=re.M))


def main():
    stale = []
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        document, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
        written = PLACE.sub(lambda m: m[1] + quoted(m[2], document, m[3] or "") + "```", text)
        if written != text:
            stale.append(document)
            if "--check" not in sys.argv[1:]:
                path.write_text(written, encoding="utf-8")
    if stale and "--check" in sys.argv[1:]:
        print(f"{', '.join(stale)}: a quotation is out of date; run tools/update_quotes.py")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
