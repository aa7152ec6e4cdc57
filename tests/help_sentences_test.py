#!/usr/bin/env python3
"""The sentence of every flag of every verb stands alone: it is read without the sentences around it.

usage: help_sentences_test.py PROGRAM [--list]
"""
import re
import subprocess
import sys

# A sentence that begins so needs the one before it, or does not name a quantity.
NEEDS_ANOTHER = re.compile(r"^(Of|The same|It|They|This|That|These|Those|Its|Another|Others?|Further)\b|^(\.\.\.|…)|(\.\.\.|…)$")
COLUMN = 34  # in which the sentence begins
FLAG = re.compile(r"^  (-[^ ]+|[a-z_.]+\.[a-z0-9_]+=)")  # also a key that --set takes


def help_text(program, words):
    return subprocess.run([program, *words, "--help-all"], capture_output=True, text=True, check=True).stdout


def verbs_of(text):
    block = re.search(r"^Verbs:\n((?:  .*\n)+)", text, re.M)
    return [line.split()[0] for line in block[1].splitlines() if not line.startswith("   ")] if block else []


def sentences(text):
    """(flag, sentence) of each flag of a help text; a sentence goes on in the lines indented below it."""
    found = []
    for line in text.splitlines():
        if FLAG.match(line):
            raw = line.encode()  # columns are bytes
            begins_here = len(raw) > COLUMN and raw[COLUMN - 1:COLUMN] == b" "
            found.append([raw[:COLUMN].decode().strip(), raw[COLUMN:].decode() if begins_here else ""])
        elif found and line.startswith(" " * 20):
            found[-1][1] = (found[-1][1] + " " + line.strip()).strip()
        elif line and not line.startswith(" "):
            found.append(["", ""])  # a heading: what follows belongs to no flag before it
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
        print(f"only {count} flags were read: the help's layout has changed, and this test with it")
    print(f"{count} flags, {len(bad)} whose sentence does not stand alone")
    return 1 if bad or count < 300 else 0


if __name__ == "__main__":
    sys.exit(main())
