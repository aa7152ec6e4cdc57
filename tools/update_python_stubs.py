#!/usr/bin/python3
"""Writes the type stubs python/waymark/*.pyi from the docstrings of the extension module.

usage: tools/update_python_stubs.py [--check]     PYTHONPATH contains the built package; --check: exit code 1 if a stub is out of date
"""
import inspect
import pathlib
import re
import sys

try:
    import waymark
except ImportError as failure:
    sys.exit(f"{pathlib.Path(__file__).name}: {failure}. PYTHONPATH names the built package: PYTHONPATH=build/check/python tools/{pathlib.Path(__file__).name}")

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "python" / "waymark"
ROOMS = [name for name in waymark.__all__ if name not in ("ReplaySession", "WaymarkError", "errors")]
HEAD = '''# Written by tools/update_python_stubs.py.
import os
from typing import Any, Iterable, Iterator, Optional, Union

import numpy as np
from numpy.typing import NDArray
'''
SIGNATURE = re.compile(r"^(?:\d+\. )?(\w*)\((.*)\) -> (.+)$")
GENERIC = {"List": "list", "Dict": "dict", "Tuple": "tuple", "Set": "set"}


def split(text):
    """Splits at commas outside of brackets and quotes."""
    parts, depth, start, quoted = [], 0, 0, False
    for i, letter in enumerate(text):
        quoted ^= letter == "'"
        depth += (letter in "([{<") - (letter in ")]}>" and text[i - 1 : i + 1] != "->")
        if letter == "," and depth == 0 and not quoted:
            parts.append(text[start:i].strip())
            start = i + 1
    return [part for part in [*parts, text[start:].strip()] if part]


def type_of(text, room, used):
    text = re.sub(r"numpy\.ndarray\[numpy\.(\w+)\]", r"NDArray[np.\1]", text)
    text = text.replace("numpy.ndarray", "NDArray[Any]").replace("Union[os.PathLike, str, bytes]", "Union[str, os.PathLike[str]]")
    text = re.sub(r"\bos\.PathLike\b(?!\[)", "Union[str, os.PathLike[str]]", text)
    text = re.sub(r"\b(List|Dict|Tuple|Set)\[", lambda found: GENERIC[found.group(1)] + "[", text)
    text = re.sub(r"\bobject\b|\bfunction\b", "Any", text)
    text = re.sub(r"\bdict\b(?!\[)", "dict[str, Any]", text)
    text = re.sub(r"\blist\b(?!\[)", "list[Any]", text)
    text = re.sub(r"\btuple\b(?!\[)", "tuple[Any, ...]", text)

    def own(found):
        if found.group(1) == room:
            return found.group(2)
        used.add(found.group(1))
        return f"_{found.group(1)}.{found.group(2)}"

    text = re.sub(r"waymark(?:\._waymark)?\.(\w+)\.(\w+)", own, text)
    if "::" in text:
        raise SystemExit(f"{room}: a type that is not bound: {text}")
    return text


def parameter(text, room, used):
    if text.startswith("*"):
        return text + ": Any"
    name, _, rest = text.partition(": ")
    if name == "self":
        return "self"
    kind, equals, _ = rest.partition(" = ")
    return f"{name}: {type_of(kind, room, used)}" + (" = ..." if equals else "")


def signatures(documentation, room, used):
    """(parameters, return type) of each overload."""
    found = []
    for line in (documentation or "").splitlines():
        match = SIGNATURE.match(line.strip())
        if match and not match.group(2).startswith("*args, **kwargs"):
            parameters = [parameter(part, room, used) for part in split(match.group(2))]
            found.append((parameters, type_of(match.group(3), room, used)))
        if match is None and found and not re.search(r"^\d+\. |Overloaded", documentation, re.M):
            break
    return found


def function(name, value, room, used, indent, decorator=None):
    overloads = signatures(value.__doc__, room, used) or [(["self", "*args: Any"] if indent else ["*args: Any"], "Any")]
    for parameters, returned in overloads:
        if indent and decorator is None and parameters and parameters[0] != "self":
            parameters = ["self", *parameters[1:]]
        if len(overloads) > 1:
            yield f"{indent}@_overload"
        if decorator:
            yield f"{indent}{decorator}"
        if name == "__eq__":
            parameters, returned = ["self", "other: object"], "bool"
        yield f"{indent}def {name}({', '.join(parameters)}) -> {returned}: ..."


def property_types(cls, name, room, used):
    """(type that is read, type that may be assigned or None)"""
    value = inspect.getattr_static(cls, name)
    read = re.search(r"\) -> (.+)$", (value.fget.__doc__ or "").splitlines()[0])
    written = None
    if value.fset is not None:
        written = split(re.match(r"^\((.*)\) -> ", value.fset.__doc__.splitlines()[0]).group(1))[1].partition(": ")[2]
    return type_of(read.group(1), room, used), written and type_of(written, room, used)


def class_of(cls, room, used):
    lines = [f"class {cls.__name__}:"]
    fields = getattr(cls, "_fields", None)
    for name, value in sorted(vars(cls).items()):
        static = isinstance(value, staticmethod)
        if isinstance(value, property):
            read, written = property_types(cls, name, room, used)
            lines += ["    @property", f"    def {name}(self) -> {read}: ..."]
            if written:
                lines += [f"    @{name}.setter", f"    def {name}(self, value: {written}) -> None: ..."]
        elif name == "__init__" and fields and "**kwargs" in value.__doc__:
            words = [f"{field}: {property_types(cls, field, room, used)[1]} = ..." for field in fields]
            lines.append(f"    def __init__(self, *, {', '.join(words)}) -> None: ...")
        elif callable(value) or static:
            if name.startswith("_") and name not in ("__init__", "__matmul__", "__mul__", "__eq__", "__len__", "__getitem__", "__setitem__", "__delitem__",
                                                     "__iter__", "__next__", "__contains__", "__enter__", "__exit__"):
                continue
            lines += function(name, value.__func__ if static else value, room, used, "    ", "@staticmethod" if static else None)
    return lines if len(lines) > 1 else [lines[0] + " ..."]


def stub_of(room):
    module, used, body = getattr(waymark, room), set(), []
    for name, value in sorted(vars(module).items()):
        if name.startswith("_"):
            continue
        body.append("")
        body += class_of(value, room, used) if inspect.isclass(value) else function(name, value, room, used, "")
    imports = "".join(f"from . import {other} as _{other}\n" for other in sorted(used))
    overload = "from typing import overload as _overload\n" if any("@_overload" in line for line in body) else ""
    return HEAD + overload + imports + "\n".join(body) + "\n"


def main():
    stubs = {f"{room}.pyi": stub_of(room) for room in ROOMS}
    stubs["_waymark.pyi"] = "# Written by tools/update_python_stubs.py.\nfrom typing import Any\n\n__version__: str\n\ndef __getattr__(name: str) -> Any: ...\n"
    old = [name for name, text in stubs.items() if not (FOLDER / name).exists() or (FOLDER / name).read_text() != text]
    if "--check" in sys.argv[1:]:
        for name in old:
            print(f"python/waymark/{name} is old: run tools/update_python_stubs.py")
        return 1 if old else 0
    for name in old:
        (FOLDER / name).write_text(stubs[name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
