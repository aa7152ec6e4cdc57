#!/usr/bin/python3
"""Finds words of tools/banned_words.txt in source, tests, help and docs, and measures the sentences of docs, errors and docstrings.

usage: tools/check_words.py [--measure] [--list] [PATH ...]

Exit code 1 if a banned word is used that tools/allowed_words.txt (lines "file | word | reason") does not allow there, or if a line of that
file allows a word that is not used. --list prints each use; otherwise files with their counts. PATH limits the search to these files and
folders.

--measure prints the lengths of sentences and the wide lines of docs instead; exit code 1 if a limit is exceeded.
Not measured as sentences: tables, headings, code blocks, tests, SQL, style sheets, message definitions, usage lines and generated pages.
A code span, a formula and the target of a link count as one word each. A citation in parentheses (a title in quotes and a year) does not
count. Not measured as wide: tables, headings, code blocks, HTML comments, and lines without a space to break at; a code span or a formula
is not broken.
"""
import ast
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BANNED = ROOT / "tools/banned_words.txt"
ALLOWED = ROOT / "tools/allowed_words.txt"
READ = (".cpp", ".hpp", ".py", ".pyi", ".md", ".ts", ".js", ".css", ".html", ".sh", ".txt", ".cmake", ".yaml", ".yml", ".in")
SKIPPED = ("LICENSE", "tools/banned_words.txt", "tools/allowed_words.txt", "tools/check_words.py", "tools/same_bytes_renames.txt")
GENERATED = ("docs/reference/cli.md", "docs/reference/python.md")
NOT_PROSE = re.compile(r"\b(CREATE TABLE|INSERT INTO|SELECT )|^usage:|^\s*waymark[ -]|u?int\d+ \w+=|[\w-]+: [^;{}]+; [\w-]+: [^;{}]+;")
CITATION = re.compile(r'\s\((?:[^()"]|\([^()]*\))*"[^"]*"(?:[^()]|\([^()]*\))*(?:19|20)\d\d(?:[^()]|\([^()]*\))*\)')
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
    """snake_case and CamelCase names as words, so that `is_said` is found; include paths stay out."""
    if line.lstrip().startswith("#include"):
        return ""
    line = re.sub(r"(?<=[a-z0-9])_(?=[a-z])", " ", line)
    return re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", line) if not re.search(r"\bk[A-Z]", line) else line


def suspicious_lines(names):
    """(file, line number, line) of the lines that may contain a banned word: grep is far quicker than one search per word and line."""
    words = "|".join(row[0].replace("(?:", "(").replace(" ", "[ _]?") for row in rows_of(BANNED))
    words = re.sub(r"\(\?[!=][^)]*\)", "", words)  # grep knows no lookahead
    for start in range(0, len(names), 500):
        found = subprocess.run(["grep", "-nHaiE", "-e", words, *names[start:start + 500], "/dev/null"], cwd=ROOT, capture_output=True,
                               check=False).stdout.decode("utf-8", errors="replace")
        for line in found.splitlines():
            name, number, text = line.split(":", 2)
            yield name, int(number), text


def uses(paths):
    """(file, line number, word, instead, line) for each use."""
    rows = list(banned())
    for name, number, line in suspicious_lines(list(files(paths))):
        shown = identifiers_apart(line)
        for pattern, instead, right in rows:
            for match in pattern.finditer(shown):
                around = shown[max(0, match.start() - 30):match.end() + 30]
                if not (right and right.search(around)):
                    yield name, number, match.group(0), instead, line.strip()


def plain(text):
    """Text with each code span, formula and link target as one word, and without citations."""
    text = re.sub(r"\$`[^`]*`\$|``.+?``|`[^`]*`", "`x`", text, flags=re.S)
    text = re.sub(r"\]\([^)\s]*\)", "]", text)
    return CITATION.sub("", text)


def sentences(text):
    return re.split(r"(?:(?<=[.!?])|(?<=[.!?][)\"*])|(?<=[.!?]\*\*))\s+(?=[A-Z0-9`*<\[(\"])|(?<=[:;])\s+(?=[A-Z])", " ".join(text.split()))


def sentences_of_docs(paths):
    for name in files(paths or ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs", "labs"]):
        if name.endswith(".md") and name not in GENERATED:
            text = (ROOT / name).read_text(encoding="utf-8")
            text = re.sub(r"^( *)```.*?^\1```[ ]*$", "\n\n", text, flags=re.M | re.S)
            text = re.sub(r"(?<=\n\n)(?: {4}.*\n)+", "\n", text)
            text = re.sub(r"^ *\|.*$|^#.*$|<!--.*?-->", "\n\n", text, flags=re.M)
            for part in re.split(r"\n\s*\n|\n\s*[-*] |\n\s*\d+\. ", text):
                for sentence in sentences(plain(part)):
                    yield name, sentence


def comments_of(text, sign):
    """Comments: consecutive lines that hold nothing else are one, and so are lines below the comment of a line of code, in its column."""
    column, parts = -1, []
    for line in [*text.split("\n"), ""]:
        found = re.match(rf"((?:[^\"'/#]|\"(?:[^\"\\]|\\.)*\"|'[^']*'|/(?!/))*?)(?:{sign}) ?(.*)", line)
        if parts and (not found or found[1].strip() or len(found[1]) != column):
            yield "\n".join(parts)
            parts = []
        if found:
            column = len(found[1])
            parts.append("\n" + found[2] + "\n" if re.match(r"\s*[-*|#]+ |%%|namespace \S+$", found[2]) else found[2])


def strings_of(text):
    """Adjacent literals of C++ as one string."""
    for raw in re.findall(r'R"(\w*)\((.*?)\)\1"', text, re.S):
        yield raw[1]
    text = re.sub(r'R"(\w*)\(.*?\)\1"', "", text, flags=re.S)
    text = re.sub(r"^\s*#include.*$|'(?:[^'\\\n]|\\.)'", "", re.sub(r"^\s*//.*$", "", text, flags=re.M), flags=re.M)
    for match in re.finditer(r'(?:"(?:[^"\\\n]|\\.)*"\s*)+', text):
        yield "".join(re.findall(r'"((?:[^"\\\n]|\\.)*)"', match[0])).replace("\\n", "\n")


def prose_of_python(text):
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    yield from comments_of(text, "#")


def sentences_of_source(paths):
    for name in files(paths or ["waymark", "python"]):
        if name.endswith((".cpp", ".hpp", ".py")) and "_test." not in name:
            text = (ROOT / name).read_text(encoding="utf-8")
            prose = prose_of_python(text) if name.endswith(".py") else [*comments_of(text, "//[/!]?<?"), *strings_of(text)]
            for part in prose:
                # A blank, indented, aligned or usage line, an item or a row of a table is not part of the sentence before it.
                for block in re.split(r"\n\s*\n|\n(?=\s|[-*] |\w+: |[^\n]*\S {2,}\S)|(?<=[^\n.]{3})\n(?=usage:)", part):
                    for sentence in sentences(plain(block)):
                        if sentence.count(" ") >= 3 and not NOT_PROSE.search(sentence):
                            yield name, sentence


def too_wide(line):
    """Whether a line is longer than the limit though a word before the limit could go to the next line. Headings, tables and comments cannot break."""
    if len(line) <= MAX_COLUMNS or re.match(r"\s*\||#|<!--", line):
        return False
    text = re.sub(r"\$`[^`]*`\$|``.+?``|`[^`]*`", lambda span: span[0].replace(" ", "_"), line)
    words = re.match(r"\s*(?:[-*]|\d+\.)?\s*", text)
    return 0 <= text.find(" ", words.end()) <= MAX_COLUMNS


def wide_lines(paths):
    for name in files(paths or ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs", "labs"]):
        if name.endswith(".md") and name not in GENERATED:
            text = (ROOT / name).read_text(encoding="utf-8")
            text = re.sub(r"^( *)```.*?^\1```[ ]*$|(?<=\n\n)(?: {4}.*\n)+", lambda code: "\n" * code[0].count("\n"), text, flags=re.M | re.S)
            for number, line in enumerate(text.split("\n"), 1):
                if too_wide(line):
                    yield f"{name}:{number}"


def measure(paths):
    """Prints the lengths of sentences; whether they are within the limits."""
    good = True
    for what, measured in (("docs", sentences_of_docs(paths)), ("source", sentences_of_source(paths))):
        lengths = [(len(sentence.split()), name, sentence) for name, sentence in measured if len(sentence.split()) > 2]
        if not lengths:
            continue
        long = [row for row in lengths if row[0] > MAX_WORDS]
        mean = sum(row[0] for row in lengths) / len(lengths)
        good &= not long and mean <= MAX_MEAN
        print(f"{what}: {len(lengths)} sentences, {mean:.1f} words on average (at most {MAX_MEAN}), {len(long)} longer than {MAX_WORDS}")
        for words, name, sentence in sorted(long, reverse=True):
            print(f"  {words} {name}: {sentence[:140]}")
    wide = list(wide_lines(paths))
    print(f"docs: {len(wide)} lines of more than {MAX_COLUMNS} columns" + "".join(f"\n  {place}" for place in wide))
    return good and not wide


def main():
    options = [word for word in sys.argv[1:] if word.startswith("--")]
    paths = [word for word in sys.argv[1:] if not word.startswith("--")]
    if set(options) - {"--measure", "--list"}:
        print(__doc__, file=sys.stderr)
        return 2
    if "--measure" in options:
        return 0 if measure(paths) else 1
    rows = list(rows_of(ALLOWED))
    without_reason = [row for row in rows if len(row) != 3]
    for row in without_reason:
        print(f"tools/allowed_words.txt: '{' | '.join(row)}' is not of the form 'file | word | reason'")
    allowed = {(row[0], row[1].lower()) for row in rows if len(row) == 3}
    used = list(uses(paths))
    unused = set() if paths else allowed - {(use[0], use[2].lower()) for use in used}
    for name, word in sorted(unused):
        print(f"tools/allowed_words.txt: {name} does not use '{word}'; delete the line")
    found = [use for use in used if (use[0], use[2].lower()) not in allowed]
    counts = {}
    for name, number, word, instead, line in found:
        counts[name] = counts.get(name, 0) + 1
        if "--list" in options:
            print(f"{name}:{number}: '{word}' ({instead}): {line[:160]}")
    if "--list" not in options:
        for name, count in sorted(counts.items(), key=lambda item: -item[1]):
            print(f"{name}: {count}")
    print(f"{len(found)} banned words in {len(counts)} files" + ("" if not found else "; --list names them, tools/banned_words.txt what to write instead"))
    return 1 if found or unused or without_reason else 0


if __name__ == "__main__":
    sys.exit(main())
