#!/usr/bin/python3
"""Prints the functions that the libraries of a build define for other programs: those declared in the first part of cmake/public_headers.txt.

usage: tools/list_symbols.py BUILD_FOLDER
One demangled signature per line, sorted, from `nm`. Functions defined in headers are not included: a program compiles them itself.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SYMBOL = re.compile(r"^(?:[0-9a-f]+)? T (waymark::[^\n]*)$", re.M)


def public_text():
    """The public headers, without comments and private members."""
    part = (ROOT / "cmake/public_headers.txt").read_text(encoding="utf-8").split("\n\n")[0]
    texts = [(ROOT / line).read_text(encoding="utf-8") for line in part.splitlines() if line.startswith("waymark/")]
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", "\n".join(texts), flags=re.S)
    return re.sub(r"\n private:.*?(?=\n};|\n public:)", "", text, flags=re.S)


def called(text):
    """Names followed by an opening bracket."""
    return set(re.findall(r"(~?\w+)\s*\(", text)) | set(re.findall(r"operator\S+?(?=\()", text))


def is_public(signature, known_names, functions, members):
    """Whether the headers declare a function or member function of this name, and contain each of our types among its arguments."""
    head = re.sub(r"\[abi:\w+\]", "", re.split(r"[(<]", signature, maxsplit=1)[0]).split("::")
    types = set(re.findall(r"waymark::((?:\w+::)*\w+)", signature[len("::".join(head)):]))
    if "internal" in head or any(part not in known_names for name in types for part in name.split("::")):
        return False
    classes = [name for name in head[1:-1] if name[:1].isupper()]
    declared = members.get(classes[0], set()) if classes else functions
    return head[-1] in declared and all(name.lstrip("~") in known_names for name in head)


def symbols(build):
    """Signatures of the libraries below `build`, sorted."""
    libraries = sorted(pathlib.Path(build).glob("waymark/**/*.a"))
    if not libraries:
        sys.exit(f"{build}: holds no library: build it first")
    listed = subprocess.run(["nm", "--defined-only", "--extern-only", "--demangle", *libraries], capture_output=True, text=True, check=True).stdout
    text = public_text()
    known_names, functions = set(re.findall(r"\w+", text)), called(text)
    classes = re.findall(r"^(?:class|struct) +(\w+)[^;(){]*\{(.*?)^\};", text, re.S | re.M)
    members = {name: called(body) for name, body in classes}
    return sorted({signature for signature in SYMBOL.findall(listed) if is_public(signature, known_names, functions, members)})


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    print("\n".join(symbols(sys.argv[1])))


if __name__ == "__main__":
    main()
