"""Golden pages: the texts of errors, warnings and reports that system tests print (tests/support/golden_page.hpp).

    golden_page.expect(self, "map", outcome.err)

compares a text with its entry on tests/pages/PAGE.txt. tools/update_pages.py regenerates all pages."""
import collections
import os
import pathlib
import re

PAGES = pathlib.Path(__file__).resolve().parent.parent / "pages"
PROJECT = str(PAGES.parent.parent)
ENTRY = "=== "
TEMPORARY = re.compile(r"/tmp/waymark-[^/ ':,]*")
NUMBER = re.compile(r"(^|[^A-Za-z0-9_#])[-+]?[0-9]+(\.[0-9]+)?(e[-+]?[0-9]+)?(?![0-9]*[A-Za-z_])", re.M)
CALLS = collections.Counter()


def masked(text):
    return NUMBER.sub(r"\1#", TEMPORARY.sub("FOLDER", text).replace(PROJECT, "PROJECT"))


def read_page(file):
    entries, entry = {}, None
    for line in file.read_text(encoding="utf-8").splitlines() if file.is_file() else ():
        if line.startswith(ENTRY):
            entry = line[len(ENTRY):]
            entries[entry] = ""
        elif entry:
            entries[entry] += line + "\n"
    return entries


def expect(test, page, text, name=None):
    """`test`: the unittest.TestCase. With `name`, the entry has this name, and its numbers are compared as well."""
    shown = (masked(text) if name is None else text).rstrip("\n") + "\n\n"
    name = name or test.id().replace("__main__.", "")
    CALLS[name] += 1
    entry = name if CALLS[name] == 1 else f"{name} {CALLS[name]}"
    out = os.environ.get("WAYMARK_PAGES_OUT")
    if out:
        pathlib.Path(out).mkdir(parents=True, exist_ok=True)
        part = pathlib.Path(out) / f"{page}@{entry}".replace("/", "_")
        part.write_text(f"{page}\n{ENTRY}{entry}\n{shown}", encoding="utf-8")
        return
    entries = read_page(PAGES / f"{page}.txt")
    if entry not in entries:
        test.fail(f"tests/pages/{page}.txt has no entry '{entry}'. Run tools/update_pages.py. The text is:\n{shown}")
    test.assertEqual(entries[entry], shown, f"tests/pages/{page}.txt, entry '{entry}'. If the new words are right, run tools/update_pages.py.")
