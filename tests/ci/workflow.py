"""Reads .github/workflows/ci.yml: what its steps run, in order."""
import pathlib
import sys

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILE = ROOT / ".github/workflows/ci.yml"
CHECKOUT = "actions/checkout"


def jobs(text):
    return yaml.safe_load(text)["jobs"]


def lines(text):
    """The commands of all steps; CHECKOUT stands for the step that brings the sources."""
    found = []
    for job in jobs(text).values():
        for step in job["steps"]:
            if "run" in step:
                found += [line.strip() for line in step["run"].splitlines() if line.strip()]
            elif step["uses"].partition("@")[0] == CHECKOUT:
                found.append(CHECKOUT)
            else:
                found.append(f"uses {step['uses']}")
    return found


if __name__ == "__main__":
    sys.stdout.write("".join(f"{line}\n" for line in lines(FILE.read_text())))
