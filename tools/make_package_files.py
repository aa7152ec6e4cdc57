#!/usr/bin/python3
"""Writes the files of a package besides programs: manual pages and changelogs.

usage: tools/make_package_files.py VERSION FOLDER
Writes to FOLDER: man/waymark.1.gz, man/waymark-VERB.1.gz and man/waymark-watchdog.1.gz from docs/reference/cli.md, which contains the output of
`waymark … --help-all`; changelog.gz (CHANGELOG.md) and changelog.Debian.gz. The date is SOURCE_DATE_EPOCH; the same input gives the same bytes.
"""
import datetime
import gzip
import os
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"<!-- help: (waymark ?[a-z -]*?) -->\n```text\n(.*?)^```\n", re.S | re.M)
EXIT_ROW = re.compile(r"^\| (\d+) \| (.*) \|$", re.M)
WATCHDOG = ("waymark-watchdog", "Stops a robot whose program has ended, is frozen or silent",
            "waymark starts this program between itself and the robot; it is not meant to be started by hand.\n"
            "When no command has come for a quarter of a second it commands the robot to stop.")


def escaped(text):
    """The text escaped for roff."""
    return "\n".join(("\\&" + line if line.startswith((".", "'")) else line) for line in text.replace("\\", "\\e").replace("-", "\\-").split("\n"))


def page(name, sentence, body, exit_rows, others, version, date):
    """One page; `body` is help text in columns, which is not reformatted."""
    title = name.replace(" ", "-")
    parts = [f'.TH {title.upper()} 1 "{date}" "waymark {version}" "User Commands"', ".SH NAME", f"{escaped(title)} \\- {escaped(sentence)}",
             ".SH DESCRIPTION", ".nf", escaped(body.strip("\n")), ".fi"]
    if exit_rows:
        parts.append(".SH EXIT STATUS")
        for code, meaning in exit_rows:
            parts += [".TP", f".B {code}", escaped(meaning.replace("`", ""))]
    parts += [".SH SEE ALSO", ", ".join(escaped(other) + "(1)" for other in others)]
    return "\n".join(parts) + "\n"


def pages(text, version, date):
    """File name → roff source."""
    exit_rows = EXIT_ROW.findall(text)
    blocks = [(name.strip(), body) for name, body in BLOCK.findall(text)]
    if not blocks:
        sys.exit("docs/reference/cli.md holds no help texts")
    names = [name.replace(" ", "-") for name, _ in blocks]
    made = {}
    for name, body in blocks:
        sentence = body.strip("\n").split("\n")[0].rstrip(".")
        others = [n for n in names if n != name.replace(" ", "-")] if name == "waymark" else ["waymark"]
        made[name.replace(" ", "-")] = page(name, sentence, "\n".join(body.strip("\n").split("\n")[1:]), exit_rows, others, version, date)
    name, sentence, body = WATCHDOG
    made[name] = page(name, sentence, body, [], ["waymark"], version, date)
    return made


def debian_changelog(version, when):
    """The changelog of the package (Debian Policy Manual, section 4.4): one entry that refers to the changelog of the project."""
    date = when.strftime("%a, %d %b %Y %H:%M:%S +0000")
    return (f"waymark ({version}-1) unstable; urgency=medium\n\n  * Release {version}: see changelog.gz.\n\n"
            f" -- The Waymark authors <waymark@example.org>  {date}\n")


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text.encode(), 9, mtime=0))


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    version, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    when = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), datetime.timezone.utc)
    reference = (ROOT / "docs/reference/cli.md").read_text(encoding="utf-8")
    for name, source in pages(reference, version, when.strftime("%Y-%m-%d")).items():
        write(folder / "man" / f"{name}.1.gz", source)
    write(folder / "changelog.gz", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))
    write(folder / "changelog.Debian.gz", debian_changelog(version, when))


if __name__ == "__main__":
    main()
