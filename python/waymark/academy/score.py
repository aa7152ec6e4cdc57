"""Scores the estimates against the ground truth of the simulator."""

import dataclasses
import math

POSITION_M = 0.25  # an estimate is accepted within this …
HEADING_DEG = 10.0  # … and this


@dataclasses.dataclass
class ScoredImage:
    """One image of the simulated camera, and the estimate that the solution showed before the next."""

    s: float  # simulated time
    truth: tuple  # (x, y, yaw) in metres and radians in the map
    estimate: tuple = None  # the last one shown
    truth_of_estimate: tuple = None  # ground truth when it was shown
    not_finite: int = 0  # estimates with NaN or infinity, which are ignored
    left: int = 0  # number of images in the remaining time
    finished: bool = False  # the time was over after this image


def _rms(values):
    return math.hypot(*values) / math.sqrt(len(values)) if values else math.nan


def score(images, left=0):
    """Returns a dictionary of numbers, NaN if nothing was shown. The points are the percentage of images after which an estimate was
    shown within 0.25 m and 10 degrees of the truth; `left` additional images count as without an estimate."""
    shown = [(p.estimate, p.truth_of_estimate) for p in images if p.estimate is not None]
    position_m = [math.dist(pose[:2], truth[:2]) for pose, truth in shown]
    heading_deg = [math.degrees(abs(math.remainder(pose[2] - truth[2], 2 * math.pi))) for pose, truth in shown]
    good = sum(p <= POSITION_M and h <= HEADING_DEG for p, h in zip(position_m, heading_deg))
    sorted_m = sorted(position_m)
    return {
        "points": round(100 * good / max(len(images) + left, 1), 1),
        "images": len(images),
        "estimates": len(shown),
        "estimates_not_finite": sum(p.not_finite for p in images),
        "position_rmse_m": round(_rms(position_m), 4),
        "position_p95_m": round(sorted_m[min(len(shown) - 1, int(0.95 * len(shown)))], 4) if shown else math.nan,
        "heading_rmse_deg": round(_rms(heading_deg), 3),
        "driven_m": round(sum(math.dist(a.truth[:2], b.truth[:2]) for a, b in zip(images, images[1:])), 2),
    }
