#!/usr/bin/python3
"""Turns labs/*.py (cells: `# %%` code, `# %% [markdown]` text) into notebooks.

usage: tools/make_notebooks.py OUTPUT_FOLDER [--solved]     --solved: with the solution before the check. Needs python3-nbformat.

An existing notebook is not changed. Also writes plant/, the log of a simulated robot that shares no code with Waymark's simulator
(tests/plant/generate_log.py).
"""
import importlib.util
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LABS = ROOT / "labs"
CHECK = "## Check"


def cells_of(text):
    """(is markdown, text) of each cell."""
    parts = re.split(r"^# %%( \[markdown\])?[ ]*\n", text, flags=re.M)
    for markdown, body in zip(parts[1::2], parts[2::2]):
        lines = body.strip("\n").split("\n")
        yield bool(markdown), "\n".join(re.sub(r"^# ?", "", line) for line in lines) if markdown else "\n".join(lines)


def notebook_of(lab, solution=None):
    import nbformat

    book = nbformat.v4.new_notebook(metadata={"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}})
    for number, (markdown, text) in enumerate(cells_of(lab.read_text())):
        if markdown and text.startswith(CHECK) and solution is not None:
            book.cells.append(nbformat.v4.new_code_cell(solution.read_text(), id="solution"))
        book.cells.append((nbformat.v4.new_markdown_cell if markdown else nbformat.v4.new_code_cell)(text, id=f"cell-{number}"))
    nbformat.validate(book)
    return nbformat.writes(book)


def main():
    arguments = [word for word in sys.argv[1:] if word != "--solved"]
    if len(arguments) != 1 or not arguments[0]:
        print(__doc__, file=sys.stderr)
        return 2
    missing = [name for name in ("nbformat", "numpy") if importlib.util.find_spec(name) is None]
    if missing:
        print(f"make_notebooks.py: {sys.executable} has no {' and no '.join(missing)} (Debian: python3-nbformat python3-numpy)", file=sys.stderr)
        return 1
    try:
        return write_course(pathlib.Path(arguments[0]))
    except OSError as failure:
        print(f"make_notebooks.py: {failure.filename or arguments[0]}: {failure.strerror}. Name a folder that may be written, on a disk with room.", file=sys.stderr)
        return 1


def write_whole(path, text):
    """Writes a file completely or not at all."""
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(text)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    part.replace(path)


def write_course(output):
    """Writes the notebooks and their data; returns the exit code."""
    output.mkdir(parents=True, exist_ok=True)
    for lab in sorted(LABS.glob("[0-9]*.py")):
        solution = LABS / "solutions" / lab.name if "--solved" in sys.argv else None
        book = output / f"{lab.stem}.ipynb"
        if book.exists():  # may contain answers
            print(f"{book} exists already, and stays as it is")
            continue
        write_whole(book, notebook_of(lab, solution))
        print(book)
    done = subprocess.run([sys.executable, ROOT / "tests" / "plant" / "generate_log.py", output / "plant"], check=False, capture_output=True, text=True)
    if done.returncode != 0:
        print(f"make_notebooks.py: {output / 'plant'} was not written: {(done.stderr.strip().splitlines() or ['no words'])[-1]}", file=sys.stderr)
        return 1
    print(f"{output / 'plant'}\nThe other data: waymark samples {output / 'samples'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
