#!/usr/bin/python3
"""The second judge: cross-track error, tag errors, ATE, RPE and NEES, in numpy without any code of Waymark."""
import argparse
import dataclasses
import json
import math
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import course
import frames


@dataclasses.dataclass
class Errors:
    rmse_m: float
    max_m: float
    count: int

    def cm(self) -> str:
        return f"{100 * self.rmse_m:.2f} / {100 * self.max_m:.2f}"


def errors(lengths_m: np.ndarray) -> Errors:
    if len(lengths_m) == 0:
        return Errors(math.nan, math.nan, 0)
    return Errors(float(np.sqrt(np.mean(np.square(lengths_m)))), float(np.max(lengths_m)), len(lengths_m))


def read_truth(file: pathlib.Path) -> np.ndarray:
    """Rows of t_s, x_m, y_m, yaw_rad, commanded speed, commanded yaw rate."""
    return np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)


def distance_to_line(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Distance of each point from the nearest point of a polyline."""
    start, step = line[:-1], np.diff(line, axis=0)
    square = np.maximum((step ** 2).sum(axis=1), 1e-18)
    found = np.empty(len(points))
    for place, point in enumerate(points):
        along = np.clip(((point - start) * step).sum(axis=1) / square, 0, 1)
        found[place] = np.sqrt((((start + along[:, None] * step) - point) ** 2).sum(axis=1).min())
    return found


def moving(truth: np.ndarray) -> np.ndarray:
    """Rows between the first and the last moving command."""
    ordered = np.flatnonzero(np.abs(truth[:, 4]) + np.abs(truth[:, 5]) > 1e-6)
    return truth[ordered[0]:ordered[-1] + 1] if len(ordered) else truth[:0]


def tracking(taught: np.ndarray, driven: np.ndarray) -> Errors:
    """True distance of the base from the true taught trajectory."""
    line = moving(taught)[::5, 1:3]
    line = line[np.concatenate([[True], np.hypot(*np.diff(line, axis=0).T) > 1e-4])]
    return errors(distance_to_line(moving(driven)[::5, 1:3], line))


def progress_m(driven: np.ndarray) -> float:
    """True distance driven by the base."""
    return float(np.hypot(np.diff(driven[:, 1]), np.diff(driven[:, 2])).sum())


def align(model: np.ndarray, data: np.ndarray, scale: bool = False) -> tuple[float, np.ndarray, np.ndarray]:
    """s, R, t that minimise the sum of |data - (s R model + t)|^2 over rows (Umeyama, "Least-squares estimation of transformation
    parameters between two point patterns", 1991)."""
    middle, other = model.mean(axis=0), data.mean(axis=0)
    u, sigma, vt = np.linalg.svd((data - other).T @ (model - middle))
    sign = np.ones(len(sigma))
    if np.linalg.det(u) * np.linalg.det(vt) < 0:
        sign[-1] = -1
    turned = u @ np.diag(sign) @ vt
    s = float((sigma * sign).sum() / ((model - middle) ** 2).sum()) if scale else 1.0
    return s, turned, other - s * turned @ middle


def read_map(file: pathlib.Path) -> dict[int, np.ndarray]:
    """map_T_tag by number, from a map.yaml."""
    found: dict[int, np.ndarray] = {}
    number, position = -1, np.zeros(3)
    for line in file.read_text().splitlines():
        key, _, value = line.strip().lstrip("- {").partition(":")
        if key == "tag":
            number = int(value.strip(' "').split(":")[1])
        elif key == "position_m":
            position = np.array(json.loads(value))
        elif key == "quaternion_xyzw":
            x, y, z, w = json.loads(value)
            found[number] = frames.rigid(frames.from_quaternion(x, y, z, w), position)
    return found


def tag_errors(mapped: dict[int, np.ndarray], tags: tuple[course.Tag, ...], anchored: bool, scale: bool = False) -> Errors:
    """Errors of positions, with the anchor at its true pose, or after the best rigid alignment (with `scale`: similarity)."""
    common = [tag for tag in tags if tag.number in mapped]
    model = np.array([mapped[tag.number][:3, 3] for tag in common])
    data = np.array([tag.world_T_tag()[:3, 3] for tag in common])
    if anchored:
        world_T_map = tags[course.ANCHOR].world_T_tag() @ frames.inverse(mapped[course.ANCHOR])
        turned, shift = world_T_map[:3, :3], world_T_map[:3, 3]
    else:
        factor, turned, shift = align(model, data, scale)
        turned = factor * turned
    return errors(np.linalg.norm(model @ turned.T + shift - data, axis=1))


@dataclasses.dataclass
class TrajectoryErrors:
    ate: Errors
    rpe_m: float
    rpe_deg: float
    nees: float  # mean normalised error squared of x, y, yaw: 3 if the covariance is consistent


def trajectory_errors(truth: np.ndarray, estimate: np.ndarray, covariance: np.ndarray | None = None, step_s: float = 1.0,
                      aligned: bool = False) -> TrajectoryErrors:
    """Rows of t, x, y, yaw; truth is interpolated to the estimate's times. Covariance: n x 3 x 3 of x, y, yaw in map axes."""
    inside = (estimate[:, 0] >= truth[0, 0]) & (estimate[:, 0] <= truth[-1, 0])
    estimate = estimate[inside]
    yaw = np.unwrap(truth[:, 3])
    true = np.column_stack([np.interp(estimate[:, 0], truth[:, 0], column) for column in (truth[:, 1], truth[:, 2], yaw)])
    found = estimate[:, 1:4].copy()
    if aligned:
        _, turned, shift = align(found[:, :2], true[:, :2])
        found = np.column_stack([found[:, :2] @ turned.T + shift, found[:, 2] + math.atan2(turned[1, 0], turned[0, 0])])
    error = found - true
    error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
    nees = math.nan
    if covariance is not None:
        nees = float(np.mean([e @ np.linalg.solve(P, e) for e, P in zip(error, covariance[inside])]))
    moved, turned_by = relative_errors(estimate[:, 0], true, found, step_s)
    return TrajectoryErrors(errors(np.hypot(error[:, 0], error[:, 1])), moved, math.degrees(turned_by), nees)


def relative_errors(t_s: np.ndarray, true: np.ndarray, found: np.ndarray, step_s: float) -> tuple[float, float]:
    """RMSE of translation and rotation of the motions over step_s."""
    later = np.searchsorted(t_s, t_s + step_s - 1e-9)
    pairs = [(i, int(j)) for i, j in enumerate(later) if j < len(t_s) and t_s[j] - t_s[i] < 1.5 * step_s]
    moved, turned = [], []
    for i, j in pairs:
        inverse_true, inverse_found = between(true[i], true[j]), between(found[i], found[j])
        off = between(inverse_true, inverse_found)
        moved.append(math.hypot(off[0], off[1]))
        turned.append(off[2])
    return (math.sqrt(np.mean(np.square(moved))), math.sqrt(np.mean(np.square(turned)))) if pairs else (math.nan, math.nan)


def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pose of b in the frame of a, as (x, y, yaw)."""
    c, s = math.cos(a[2]), math.sin(a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    return np.array([c * dx + s * dy, -s * dx + c * dy, frames.wrap(b[2] - a[2])])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--taught", type=pathlib.Path, help="truth CSV of the taught lap (robot.py --truth)")
    parser.add_argument("--driven", type=pathlib.Path, help="truth CSV of a replay: its distance from the taught way")
    parser.add_argument("--map", type=pathlib.Path, help="map.yaml: errors of its tags on the course")
    parser.add_argument("--lean-deg", type=float, default=0.0, help="how far the anchor leaned")
    args = parser.parse_args()
    found = {}
    if args.taught and args.driven:
        found["tracking"] = dataclasses.asdict(tracking(read_truth(args.taught), read_truth(args.driven)))
    if args.map:
        tags = course.tags(math.radians(args.lean_deg))
        for name, anchored, scale in (("tags_anchored", True, False), ("tags_aligned", False, False), ("tags_aligned_scaled", False, True)):
            found[name] = dataclasses.asdict(tag_errors(read_map(args.map), tags, anchored, scale))
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
