#!/usr/bin/python3
"""The page of `waymark view` in a headless Chromium: open, scrub, step, measure, images, accessibility, a phone.

usage: page_test.py PROGRAM VIEWER_BUILD_FOLDER [IMAGES]     with IMAGES the screenshots of the documents go there
Exit code 77 (skipped) where npm could not build the page (tools/build_viewer.sh): it comes from the network. Chromium is a package of ./test.sh.
"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from made import DEMO, made  # noqa: E402

SKIPPED = 77


def browser_tools(built):
    """Node and the environment of its scripts; None if npm has not built the page."""
    modules = built / "source/node_modules"
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    npm_node = built.parent / "npm/node_modules/.bin/node"
    node = str(npm_node) if npm_node.exists() else shutil.which("node")
    if chromium is None:
        raise SystemExit("there is no Chromium: apt-get install chromium (./test.sh installs it)")
    if not (modules / "playwright-core").exists() or not (built / "stamp").exists() or node is None:
        print("npm has not built the page (tools/build_viewer.sh)")
        return None
    return node, {"WAYMARK_NODE_MODULES": str(modules), "WAYMARK_CHROMIUM": chromium}


def main():
    program, built = sys.argv[1], pathlib.Path(sys.argv[2])
    tools = browser_tools(built)
    if tools is None:
        return SKIPPED
    node, environment = tools
    with tempfile.TemporaryDirectory(prefix="waymark-view-") as folder:
        shutil.copytree(made(program, *DEMO) / "demo", folder, dirs_exist_ok=True)
        server = subprocess.Popen([program, "view", folder, "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            url = server.stdout.readline().strip()
            assert url.startswith("http://127.0.0.1:"), url
            script = pathlib.Path(__file__).resolve().parents[2] / "viewer/test/page_test.mjs"
            done = subprocess.run([node, script, url, folder, *sys.argv[3:4]], check=False, timeout=170,
                                  env={**os.environ, **environment})
        finally:
            server.send_signal(signal.SIGINT)
            assert server.wait(timeout=20) == 0
        return done.returncode


if __name__ == "__main__":
    sys.exit(main())
