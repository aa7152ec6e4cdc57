#!/usr/bin/python3
"""Finds words of tools/banned_words.txt in source, tests, help and docs, and measures the sentences of docs, errors and docstrings.

usage: tools/check_words.py [--measure] [--list] [PATH ...]

Exit code 1 when a banned word is used where tools/allowed_words.txt (lines "file | word | reason") does not allow it.
--list prints each use; otherwise files with their counts. --measure prints the lengths of sentences instead.
PATH limits the search to these files and folders.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BANNED = ROOT / "tools/banned_words.txt"
ALLOWED = ROOT / "tools/allowed_words.txt"
READ = (".cpp", ".hpp", ".py", ".pyi", ".md", ".ts", ".js", ".css", ".html", ".sh", ".txt", ".cmake", ".yaml", ".yml", ".in")
SKIPPED = ("LICENSE", "tools/banned_words.txt", "tools/allowed_words.txt", "tools/check_words.py", "tools/same_bytes_renames.txt")
MAX_WORDS, MAX_MEAN, MAX_COLUMNS = 30, 18, 120


def rows_of(file):
    for line in file.read_text(encoding="utf-8").splitlines() if file.is_file() else ():
        if line.strip() and not line.startswith("#"):
            yield [part.strip() for part in line.split(" | ")] if " | " in line else [line.strip().rstrip("|").strip()]


def banned():
    """(pattern, what to write instead, pattern of right contexts or None) for each row."""
    for row in rows_of(BANNED):
        word, instead, right = (row + ["", "", ""])[:3]
        right = right.strip("| ")
        # A constant is found inside an identifier, a word between letters of others is not.
        edges = (r"\b(?:{})", "") if re.match("k[A-Z]", word) else (r"(?<![A-Za-z0-9_])(?:{})(?![A-Za-z0-9_])", re.I)
        yield re.compile(edges[0].format(word), edges[1] or 0), instead.rstrip("| "), re.compile(right, re.I) if right else None


def files(paths):
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", *paths], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in listed.split("\n"):
        if name.endswith(READ) and not name.startswith(SKIPPED) and (ROOT / name).is_file():
            yield name


def identifiers_apart(line):
    """snake_case and CamelCase names as words, so that `observe_standing` is found; include paths stay out."""
    if line.lstrip().startswith("#include"):
        return ""
    line = re.sub(r"(?<=[a-z0-9])_(?=[a-z])", " ", line)
    return re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", line) if not re.search(r"\bk[A-Z]", line) else line


def uses(paths):
    """(file, line number, word, instead, line) for each use."""
    rows = list(banned())
    for name in files(paths):
        for number, line in enumerate((ROOT / name).read_text(encoding="utf-8", errors="replace").splitlines(), 1):
            shown = identifiers_apart(line)
            for pattern, instead, right in rows:
                for match in pattern.finditer(shown):
                    around = shown[max(0, match.start() - 30):match.end() + 30]
                    if not (right and right.search(around)):
                        yield name, number, match.group(0), instead, line.strip()


def sentences_of_docs(paths):
    for name in files([path for path in paths or ["README.md", "CONTRIBUTING.md", "docs"]]):
        if name.endswith(".md"):
            text = (ROOT / name).read_text(encoding="utf-8")
            text = re.sub(r"^```.*?^```[ ]*$", "\n\n", text, flags=re.M | re.S)
            text = re.sub(r"^\|.*$|^#.*$|<!--.*?-->", "\n\n", text, flags=re.M)
            for part in re.split(r"\n\s*\n|\n\s*[-*] |\n\s*\d+\. ", text):
                for sentence in re.split(r"(?<=[.!?:;])\s+(?=[A-Z`*\[(])", " ".join(part.split())):
                    yield name, sentence


def sentences_of_source(paths):
    for name in files(paths or ["waymark", "python"]):
        if name.endswith((".cpp", ".hpp", ".py")) and "_test." not in name:
            text = (ROOT / name).read_text(encoding="utf-8")
            comments = re.sub(r"\n\s*//[/!]?<? ?", " ", text)
            for string in re.findall(r'"((?:[^"\\\n]|\\.)*)"', re.sub(r'"\s*\n\s*"', "", text)):
                if string.count(" ") >= 3:
                    yield name, string
            for comment in re.findall(r"//[/!]?<? ?(.*)", comments):
                for sentence in re.split(r"(?<=[.!?:;])\s+(?=[A-Z`])", comment):
                    if sentence.count(" ") >= 3:
                        yield name, sentence


def measure(paths):
    for what, sentences in (("docs", sentences_of_docs(paths)), ("source", sentences_of_source(paths))):
        lengths = [(len(sentence.split()), name, sentence) for name, sentence in sentences if len(sentence.split()) > 2]
        if not lengths:
            continue
        long = [row for row in lengths if row[0] > MAX_WORDS]
        print(f"{what}: {len(lengths)} sentences, {sum(row[0] for row in lengths) / len(lengths):.1f} words on average (at most {MAX_MEAN}), "
              f"{len(long)} longer than {MAX_WORDS}")
        for words, name, sentence in sorted(long, reverse=True)[:20]:
            print(f"  {words} {name}: {sentence[:140]}")
    wide = [f"{name}:{number}" for name in files(paths or ["README.md", "CONTRIBUTING.md", "docs"]) if name.endswith(".md")
            for number, line in enumerate((ROOT / name).read_text(encoding="utf-8").splitlines(), 1)
            if len(line) > MAX_COLUMNS and not line.startswith("|") and "](" not in line and "http" not in line]
    print(f"docs: {len(wide)} lines of more than {MAX_COLUMNS} columns" + (f", first {wide[0]}" if wide else ""))


def main():
    options = [word for word in sys.argv[1:] if word.startswith("--")]
    paths = [word for word in sys.argv[1:] if not word.startswith("--")]
    if set(options) - {"--measure", "--list"}:
        print(__doc__, file=sys.stderr)
        return 2
    if "--measure" in options:
        measure(paths)
        return 0
    allowed = {(row[0], row[1].lower()) for row in rows_of(ALLOWED)}
    found = [use for use in uses(paths) if (use[0], use[2].lower()) not in allowed]
    counts = {}
    for name, number, word, instead, line in found:
        counts[name] = counts.get(name, 0) + 1
        if "--list" in options:
            print(f"{name}:{number}: '{word}' ({instead}): {line[:160]}")
    if "--list" not in options:
        for name, count in sorted(counts.items(), key=lambda item: -item[1]):
            print(f"{name}: {count}")
    print(f"{len(found)} banned words in {len(counts)} files" + ("" if not found else "; --list names them, tools/banned_words.txt what to write instead"))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
