#!/usr/bin/python3
"""Writes docs/reference/python.md from the docstrings of the package `waymark`.

usage: tools/update_python_reference.py [--check]     PYTHONPATH contains the built package; --check: exit code 1 if the page is out of date
"""
import inspect
import pathlib
import re
import sys

try:
    import waymark
except ImportError as failure:
    sys.exit(f"{pathlib.Path(__file__).name}: {failure}. PYTHONPATH names the built package: PYTHONPATH=build/check/python tools/{pathlib.Path(__file__).name}")

PAGE = pathlib.Path(__file__).resolve().parent.parent / "docs/reference/python.md"
ROOMS = [name for name in waymark.__all__ if name not in ("ReplaySession", "WaymarkError", "errors")]
SIGNATURE = re.compile(r"^(?:\d+\. )?(\w+)\((.*)\) -> (.+)$")
HEAD = """# The Python package

Written by `tools/update_python_reference.py` from the docstrings, which `help(waymark.geometry.SE2)` shows too. Frames, units and pixels: [conventions](../conventions.md);
how to begin: [in Python](../howto/python.md). Options by keyword are those of the [flags](cli.md). The exceptions of `waymark.errors` are at the end.
"""


def plain(text):
    """A signature with the names of public modules, without `self`."""
    text = re.sub(r"waymark\._waymark\.", "waymark.", text)
    text = re.sub(r"\((?:self|arg0): waymark\.\w+\.\w+(?:, )?", "(", text)
    return re.sub(r"\bUnion\[os\.PathLike, str, bytes\]", "path", text).replace("numpy.ndarray[numpy.", "array[").replace("numpy.ndarray", "array")


def signatures(doc, name):
    """(signature, words) of each overload of a function's docstring."""
    found = []
    for line in doc.splitlines():
        match = SIGNATURE.match(line)
        if match and match.group(1) == name:
            found.append((plain(re.sub(r"^\d+\. ", "", line)), []))
        elif found:
            found[-1][1].append(line)
    return [(signature, "\n".join(words).strip()) for signature, words in found if "*args, **kwargs" not in signature]


def words_of(text):
    """A docstring as Markdown; indented lines (options) become a block."""
    lines, block = [], []
    for line in [*text.splitlines(), ""]:
        if line.startswith("  "):
            block.append(line[2:])
            continue
        if block and line.strip():
            lines += ["```text", *block, "```", ""]
            block = []
        if line or (lines and lines[-1]):
            lines.append(line)
    return "\n".join([*lines, *(["```text", *block, "```"] if block else [])]).strip()


def function(name, doc, shown):
    parts = signatures(doc or "", name) or [(f"{name}(…)", doc or "")]
    return "\n\n".join(f"`{signature.replace(name + '(', shown + '(', 1)}`" + (f"\n\n{words_of(words)}" if words else "") for signature, words in parts)


def class_of(name, kind):
    text = [f"### {name}", words_of(inspect.getdoc(kind) or "")]
    attributes = []
    for member, value in vars(kind).items():
        if member == "__init__":
            text += [function("__init__", value.__doc__, name).replace(") -> None`", ")`")] if signatures(value.__doc__, "__init__") else []
        elif member.startswith("_"):
            continue
        elif isinstance(value, property):
            attributes.append(f"- `{member}`" + (f": {' '.join(value.__doc__.split())}" if value.__doc__ else ""))
        elif callable(value) or isinstance(value, staticmethod):
            text.append(function(member, getattr(kind, member).__doc__, member))
    if attributes:
        text.insert(2, "\n".join(attributes))
    return [part for part in text if part]


def room_of(name):
    module = getattr(waymark, name)
    text = [f"## waymark.{name}", words_of(inspect.getdoc(module) or "")]
    for member, value in sorted(vars(module).items()):
        if not member.startswith("_") and inspect.isroutine(value):
            text.append(function(member, value.__doc__, member))
    for member, value in sorted(vars(module).items()):
        if inspect.isclass(value) and not member.startswith("_"):
            text += class_of(member, value)
    return text


def errors_of():
    text = ["## waymark.errors"]
    for name, value in vars(waymark.errors).items():
        if inspect.isclass(value) and issubclass(value, waymark.WaymarkError):
            text.append(f"- `{name}`: {' '.join((inspect.getdoc(value) or '').split())}")
    return ["\n".join([text[0], "", *text[1:]])]


def main():
    parts = [HEAD.strip()]
    for room in ROOMS:
        parts += room_of(room)
    page = "\n\n".join([*parts, *errors_of()]) + "\n"
    if sys.argv[1:] == ["--check"]:
        if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != page:
            print("docs/reference/python.md is old: PYTHONPATH=BUILD/python tools/update_python_reference.py", file=sys.stderr)
            return 1
        return 0
    if sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        return 2
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
