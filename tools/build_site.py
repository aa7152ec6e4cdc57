#!/usr/bin/python3
"""Builds the site of README.md and docs/ with MkDocs and its Material theme (Debian: mkdocs mkdocs-material), links checked.

usage: tools/build_site.py OUTPUT_FOLDER [--without-interactive]

The pages of web/ are built (tools/build_web.sh) and included if emscripten is installed; without it, or with --without-interactive, the page has a note.
Linked files outside docs/ (examples, READMEs of the rooms) are included in the folder source/; a link to a folder becomes plain text.
Search works without a network. Doxygen, if installed, writes pages for the public headers; without it the reference page has a note.
"""
import importlib
import importlib.util
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
MISSING = 77  # exit code if a program is missing
LINK = re.compile(r"(?<!!)\[([^\]\[]*(?:\[[^\]]*\][^\]\[]*)?)\]\(([^)\s#]*)(#[^)\s]*)?\)")
IMAGE = re.compile(r"!\[([^\]]*)\]\(([^)\s]+)\)")
FENCE = re.compile(r"(^```.*?^```[ ]*$|^ {4}[^\n]*$)", re.M | re.S)
INTERACTIVE = "<!-- interactive pages -->"
CPP = "<!-- c++ reference -->"
DOXYGEN = """PROJECT_NAME = Waymark
INPUT = {headers}
STRIP_FROM_PATH = "{root}"
STRIP_FROM_INC_PATH = "{root}"
OUTPUT_DIRECTORY = "{output}"
HTML_OUTPUT = cpp
GENERATE_LATEX = NO
EXTRACT_ALL = YES
JAVADOC_AUTOBRIEF = YES
MARKDOWN_SUPPORT = YES
HAVE_DOT = NO
CLASS_GRAPH = NO
QUIET = YES
WARNINGS = NO
HTML_TIMESTAMP = NO
"""
SECTIONS = (("Tutorials", "tutorials"), ("How to", "howto"), ("Concepts", "concepts"), ("Formats", "formats"), ("Reference", "reference"), ("Results", "results"))
CONFIG = """site_name: Waymark
site_description: Teach a robot a route once and repeat it, from AprilTags
docs_dir: docs
site_dir: {site}
theme: {{name: material, font: false, features: [navigation.sections, search.suggest, content.code.copy]}}
plugins: [search]
markdown_extensions: [tables, fenced_code, {{toc: {{permalink: true}}}}]
nav:
  - Start: index.md
  - All documents: contents.md
  - In the browser: interactive.md
  - Architecture: architecture.md
  - Conventions: conventions.md
{sections}  - Questions: faq.md
  - Glossary: glossary.md
  - Changes: source/CHANGELOG.md
"""


def staged_name(path):
    """The path of a repository file on the site."""
    if path == ROOT / "README.md":
        return pathlib.Path("index.md")
    inside = path.relative_to(ROOT)
    return pathlib.Path(*inside.parts[1:]) if inside.parts[0] == "docs" else pathlib.Path("source") / inside


class Stage:
    def __init__(self, folder):
        self.folder, self.done, self.todo = folder, set(), []

    def add(self, path):
        if path not in self.done:
            self.done.add(path)
            self.todo.append(path)

    def link(self, page, target):
        """The link from a staged page to a file; None for a folder."""
        path = (page.parent / target).resolve()
        if path.is_dir():
            return None
        if not path.is_file() or ROOT not in path.parents:
            raise SystemExit(f"{page.relative_to(ROOT)}: a link to {target}, which is not there")
        self.add(path)
        up = "../" * (len(staged_name(page).parts) - 1)
        return up + staged_name(path).as_posix()

    def rewritten(self, page, text):
        def link(match):
            words, target, anchor = match.group(1), match.group(2), match.group(3) or ""
            if not target or "://" in target or target.startswith("mailto:"):
                return match.group(0)
            there = self.link(page, target)
            return f"[{words}]({there}{anchor})" if there else words

        def image(match):
            there = match.group(2) if "://" in match.group(2) else self.link(page, match.group(2))
            return f"![{match.group(1)}]({there})"

        parts = FENCE.split(text)
        parts[::2] = [LINK.sub(link, IMAGE.sub(image, part)) for part in parts[::2]]
        return "".join(parts)

    def run(self):
        while self.todo:
            path = self.todo.pop()
            to = self.folder / staged_name(path)
            to.parent.mkdir(parents=True, exist_ok=True)
            if path.suffix == ".md":
                to.write_text(self.rewritten(path, path.read_text()))
            else:
                shutil.copy(path, to)


def sections():
    text = ""
    for title, folder in SECTIONS:
        pages = sorted((ROOT / "docs" / folder).glob("*.md"))
        text += f"  - {title}:\n" + "".join(f"      - {folder}/{page.name}\n" for page in pages)
        if folder == "results":
            text += "".join(f"      - {page.name}\n" for page in sorted((ROOT / "docs").glob("results*.md")))
    return text


def put_interactive_pages(docs, wanted):
    """Adds the pages of web/ to the documents, and to docs/interactive.md the links to them or the reason why they are missing."""
    outcome = subprocess.run([ROOT / "tools/build_web.sh"], check=False, stdout=subprocess.DEVNULL).returncode if wanted else MISSING
    if outcome not in (0, MISSING):
        raise SystemExit("tools/build_web.sh failed")
    page = docs / "interactive.md"
    words = "They are not in this copy of the site, which was built without emscripten.\n"
    if outcome == 0:
        shutil.copytree(ROOT / "build/web/pages", docs / "pages")
        words = "Open them: [Tags in an image](pages/detect.html) · [The two poses of a tag](pages/two_poses.html)\n"
    page.write_text(page.read_text().replace(INTERACTIVE, words))


def public_headers():
    """The headers that other programs may include: the first part of cmake/public_headers.txt."""
    kept = (ROOT / "cmake/public_headers.txt").read_text().split("\n# Included by those above")[0]
    return [line for line in kept.splitlines() if line.startswith("waymark/")]


def put_cpp_reference(docs):
    """Adds Doxygen's pages of the public headers in docs/cpp/, and to docs/reference/cpp.md their link or the reason why they are missing."""
    page, words = docs / "reference/cpp.md", "They are not in this copy of the site, which was built without doxygen.\n"
    if shutil.which("doxygen"):
        headers = " ".join(f'"{ROOT / header}"' for header in public_headers())
        settings = DOXYGEN.format(headers=headers, root=ROOT, output=docs)
        done = subprocess.run(["doxygen", "-"], input=settings, text=True, check=False, capture_output=True)
        if done.returncode != 0 or not (docs / "cpp/annotated.html").is_file():
            raise SystemExit(f"doxygen failed: {done.stderr}")
        words = "[Classes](../cpp/annotated.html) · [headers](../cpp/files.html) · [search](../cpp/index.html)\n"
    page.write_text(page.read_text().replace(CPP, words))


def main():
    arguments = [word for word in sys.argv[1:] if word != "--without-interactive"]
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    installed = importlib.util.find_spec("mkdocs") is not None
    if not installed or "material" not in importlib.import_module("mkdocs.utils").get_theme_names():
        print("MkDocs or its Material theme is not installed (Debian: mkdocs mkdocs-material)", file=sys.stderr)
        return MISSING
    output = pathlib.Path(arguments[0]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(pathlib.Path(folder) / "docs")
        for page in [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]:
            stage.add(page)
        stage.run()
        put_cpp_reference(stage.folder)
        put_interactive_pages(stage.folder, arguments == sys.argv[1:])
        (pathlib.Path(folder) / "mkdocs.yml").write_text(CONFIG.format(site=output, sections=sections()))
        return subprocess.run([sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"], cwd=folder, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
