#!/usr/bin/python3
"""The site with the pages that run in the browser, and its text without them; its search, without a network; 60 s at most.

usage: site_test.py OUTPUT_FOLDER
Runs with WAYMARK_FULL only, since it compiles the pages: exit code 77 (skipped) without it, whatever is installed. ./test.sh --full=site sets it and
installs emscripten, without which the test fails.
"""
import functools
import http.server
import os
import pathlib
import shutil
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/viewer"))
from page_test import browser_tools  # noqa: E402

SKIPPED = 77
MOST_S = 60  # for a site whose pages of WebAssembly are already compiled


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *words):
        pass

    def do_GET(self):
        if self.path == "/favicon.ico":  # browsers request it for Doxygen's pages, which specify no icon
            self.send_response(204)
            self.end_headers()
        else:
            super().do_GET()


def search(site):
    """Searches in a headless Chromium; requests to other servers are errors."""
    tools = browser_tools(ROOT / "build/viewer")
    if tools is None:
        return SKIPPED  # the search only; browser_tools() printed why
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        url = f"http://127.0.0.1:{server.server_address[1]}"
        return subprocess.run([tools[0], ROOT / "tests/web/search_test.mjs", url], env={**os.environ, **tools[1]}, timeout=600, check=False).returncode
    finally:
        server.shutdown()


def build(folder, *words):
    return subprocess.run([sys.executable, ROOT / "tools/build_site.py", folder, *words], check=False).returncode


def main():
    output = pathlib.Path(sys.argv[1])
    if not os.environ.get("WAYMARK_FULL"):
        print("only with WAYMARK_FULL (./test.sh --full=site)")
        return SKIPPED
    if subprocess.run([ROOT / "tools/build_web.sh"], check=False).returncode != 0:  # the missing emscripten too
        return 1
    for folder, words, there in (("with", [], True), ("without", ["--without-interactive"], False)):
        shutil.rmtree(output / folder, ignore_errors=True)
        begin = time.monotonic()
        outcome = build(output / folder, *words)
        if outcome != 0:
            return outcome
        took_s = time.monotonic() - begin
        print(f"{folder}: built in {took_s:.1f} s")
        assert took_s < MOST_S, f"{folder}: {took_s:.0f} s"
        page = (output / folder / "interactive/index.html").read_text()
        assert ("../pages/detect.html" in page) == there, f"{folder}: links to the pages"
        assert ("not in this copy of the site" in page) != there, f"{folder}: words on missing pages"
        for name in ("detect.html", "two_poses.html", "waymark.js", "page.css", "notices.txt"):
            assert (output / folder / "pages" / name).exists() == there, f"{folder}: {name}"
    return search(output / "with")


if __name__ == "__main__":
    sys.exit(main())
