"""The causes that are injected into recordings to be mapped, and whether a report of `waymark map` names them."""
import dataclasses
import re

import numpy as np

KINDS = ["size", "moved", "duplicate", "misread", "clock", "mounting"]
CHOICES = ["random", "none", *KINDS]
PRINT_SIGMA = 0.003  # of each tag's size, in every recording
MOST_CAUSES = 3
HIDDEN_S = (0.7, 3.0)  # while a tag is moved by hand
# A sentence that lists rejected observations by tag names neither a kind nor a tag.
REJECTIONS = re.compile(r"^\d+ of \d+ tag observations are inconsistent")


@dataclasses.dataclass
class Cause:
    kind: str  # of KINDS
    what: str  # tag or sensor
    amount: str


@dataclasses.dataclass
class Truth:
    """What was recorded. `places`: of each id, the centres of its prints at the end [m]. `poses`: stamps [ns] and poses of the base or the rig.
    Scenes, of whose poses the program states no covariance: `deviations_m` of each pose if the tags were exact, and the ids that its images show."""
    causes: list[Cause]
    places: dict[int, list[np.ndarray]]
    stamps_ns: np.ndarray
    poses: np.ndarray
    deviations_m: list[float] = dataclasses.field(default_factory=list)
    ids: list[set[int]] = dataclasses.field(default_factory=list)


def draw_kinds(choice: str, rng: np.random.Generator) -> list[str]:
    """`choice`: one of CHOICES; "random" stands for one to three different kinds."""
    if choice in KINDS:
        return [choice]
    count = 0 if choice == "none" else int(rng.integers(1, MOST_CAUSES + 1))
    return [str(kind) for kind in rng.choice(KINDS, count, replace=False)]


def print_sizes(count: int, rng: np.random.Generator) -> np.ndarray:
    """Printed sizes over the given size."""
    return 1 + PRINT_SIGMA * rng.standard_normal(count)


def draw_size(rng: np.random.Generator) -> float:
    """A wrong size over the given size."""
    return float(1 + rng.choice([-1, 1]) * rng.uniform(0.01, 0.10))


def misread(number: int, count: int, rng: np.random.Generator) -> int:
    """Another id; one in five belongs to no tag."""
    return int((number + 1 + rng.integers(count + count // 4 - 1)) % (count + count // 4))


def tags_of(report: dict, key: str) -> set[int]:
    return {int(str(entry["tag"]).split(":")[-1]) for entry in report.get(key) or []}


def warns_of(words: list[str], tag: int, text: str) -> bool:
    """Whether one of the warnings starts with this tag and contains the text."""
    return any(re.match(rf"tag(36h11:| ){tag}\b", line) and re.search(text, line) for line in words)


def is_named(cause: Cause, report: dict, words: list[str]) -> bool:
    """`words`: warnings, or the error."""
    words = [line for line in words if not REJECTIONS.match(line) or cause.kind == "misread"]
    if cause.kind == "size":
        return int(cause.what) in tags_of(report, "wrong_sizes")
    if cause.kind == "moved":
        return int(cause.what) in tags_of(report, "moved_tags") or warns_of(words, int(cause.what), "moved")
    if cause.kind == "duplicate":
        return int(cause.what) in tags_of(report, "duplicate_ids") or warns_of(words, int(cause.what), "two tags carry|two places")
    text = {"misread": "misread id", "clock": rf"^(?=.*(?:{cause.what}))(?=.*(?:clock|stamp|latency|time offset))",
            "mounting": f"camera mounting differs|given pose of camera {cause.what}"}[cause.kind]
    return any(re.search(text, line) for line in words)


def accused(causes: list[Cause], report: dict) -> list[str]:
    """Tags that the report names for a cause that was not injected, such as "wrong_sizes 4"."""
    kinds = {"wrong_sizes": "size", "moved_tags": "moved", "duplicate_ids": "duplicate", "missing_tags": "missing"}
    return [f"{key} {tag}" for key, kind in kinds.items() for tag in sorted(tags_of(report, key))
            if not any(cause.kind == kind and cause.what == str(tag) for cause in causes)]
