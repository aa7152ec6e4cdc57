#!/usr/bin/python3
"""Writes the output of `waymark … --help-all` into docs/reference/cli.md, below each line "<!-- help: waymark … -->".

usage: tools/update_cli_reference.py PROGRAM [--check]     --check: change nothing, exit code 1 if the page is out of date
"""
import pathlib
import re
import subprocess
import sys

PAGE = pathlib.Path(__file__).resolve().parent.parent / "docs/reference/cli.md"
PLACE = re.compile(r"(<!-- help: waymark ?([a-z0-9 -]*?) -->\n```text\n).*?(^```\n)", re.S | re.M)


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    text = PAGE.read_text(encoding="utf-8")

    def help_of(match):
        words = [sys.argv[1], *match.group(2).split(), "--help-all"]
        printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        return match.group(1) + printed.strip("\n") + "\n" + match.group(3)

    verbs = subprocess.run([sys.argv[1], "--help"], capture_output=True, text=True, check=True).stdout
    listed = re.findall(r"^  ([a-z][a-z0-9-]*) ", verbs.split("\nVerbs:\n")[1].split("\n\n")[0], re.M)
    missing = [verb for verb in listed if f"<!-- help: waymark {verb} -->" not in text]
    if missing:
        sys.exit(f"{PAGE} has no place for {', '.join(missing)}: add a section with <!-- help: waymark VERB -->")
    fresh, count = PLACE.subn(help_of, text)
    if count != text.count("<!-- help:"):
        sys.exit(f"{PAGE}: a line <!-- help: … --> without its ```text block, or with a name that is no verb's")
    if "--check" not in sys.argv:
        PAGE.write_text(fresh, encoding="utf-8")
        print(f"{PAGE}: {count} verbs")
        return 0
    if fresh == text and count > 0:
        return 0
    print(f"{PAGE} is not what --help-all prints. Run: tools/update_cli_reference.py {sys.argv[1]}")
    return 1


if __name__ == "__main__":
    sys.exit(main())
