#!/usr/bin/env python3
"""The sentence of each flag of each verb is understandable without the sentences around it.

usage: help_sentences_test.py PROGRAM [--list]
"""
import re
import subprocess
import sys

# A sentence that begins like this depends on the previous one, or does not name a quantity.
NEEDS_ANOTHER = re.compile(r"^(Of|The same|It|They|This|That|These|Those|Its|Another|Others?|Further)\b|^(\.\.\.|…)|(\.\.\.|…)$")
COLUMN = 34  # where sentences begin
FLAG = re.compile(r"^  (-[^ ]+|[a-z_.]+\.[a-z0-9_]+=)")  # also a key of --set


def help_text(program, words):
    return subprocess.run([program, *words, "--help-all"], capture_output=True, text=True, check=True).stdout


def verbs_of(text):
    block = re.search(r"^Verbs:\n((?:  .*\n)+)", text, re.M)
    return [line.split()[0] for line in block[1].splitlines() if not line.startswith("   ")] if block else []


def sentences(text):
    """(flag, sentence) of each flag of a help text; a sentence continues in the indented lines below it."""
    found = []
    for line in text.splitlines():
        if FLAG.match(line):
            raw = line.encode()  # columns are bytes
            begins_here = len(raw) > COLUMN and raw[COLUMN - 1:COLUMN] == b" "
            found.append([raw[:COLUMN].decode().strip(), raw[COLUMN:].decode() if begins_here else ""])
        elif found and line.startswith(" " * 20):
            found[-1][1] = (found[-1][1] + " " + line.strip()).strip()
        elif line and not line.startswith(" "):
            found.append(["", ""])  # a heading: the following lines belong to no earlier flag
    return [(flag, sentence) for flag, sentence in found if flag]


def all_verbs(program, words=()):
    text = help_text(program, words)
    yield list(words), text
    for verb in verbs_of(text):
        yield from all_verbs(program, [*words, verb])


def main():
    program = sys.argv[1]
    listed, bad, count = set(), [], 0
    for words, text in all_verbs(program):
        for flag, sentence in sentences(text):
            count += 1
            listed.add(sentence)
            if not sentence or NEEDS_ANOTHER.search(sentence):
                bad.append(f"waymark {' '.join(words)} {flag}: '{sentence}'")
    if "--list" in sys.argv:
        print("\n".join(sorted(listed)))
    for line in bad:
        print(line)
    if count < 300:
        print(f"only {count} flags were found: the layout of the help has changed, so this test must change")
    print(f"{count} flags, {len(bad)} whose sentence depends on others")
    return 1 if bad or count < 300 else 0


if __name__ == "__main__":
    sys.exit(main())
