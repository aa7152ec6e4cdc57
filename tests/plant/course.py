"""The course: a closed lap of 16.2 m with left and right curves (or an oval), 24 tags, and a gate of 0.84 m; or a recorded public line
with equally many tags. Frame world: floor z = 0, z up."""
import argparse
import contextlib
import csv
import dataclasses
import functools
import math
import pathlib

import numpy as np

import frames

LAP_M = 16.2
GATE_M = 0.84
TAG_SIZE_M = 0.16
TAGS = 24
ANCHOR = 0


@dataclasses.dataclass(frozen=True)
class Tag:
    number: int
    x_m: float
    y_m: float
    z_m: float
    facing_rad: float  # from the tag to its viewer
    lean_rad: float = 0.0  # positive: leans back, its face turned up
    size_m: float = TAG_SIZE_M

    def world_T_tag(self) -> np.ndarray:
        """Tag frame: x right, y down, z into the tag, as seen from its front."""
        c, s = math.cos(self.facing_rad), math.sin(self.facing_rad)
        upright = np.array([[-s, 0.0, -c], [c, 0.0, -s], [0.0, -1.0, 0.0]])
        return frames.rigid(upright @ frames.rotation(0, self.lean_rad), (self.x_m, self.y_m, self.z_m))


_recorded: np.ndarray | None = None  # an open line instead of the lap
_one_sided = False  # the lap is an oval


def use_oval() -> None:
    """Makes the lap an oval with left curves only."""
    global _one_sided
    _one_sided = True
    _own_lap.cache_clear()
    _standing.cache_clear()


def use_recorded(file: pathlib.Path, most_curvature: float = 3.8) -> None:
    """Uses the line in a file of s, x, y, theta, curvature as the course. Bends that are too tight turn by the same angle on a wider arc;
    then the noise of single points is smoothed. There is no gate; the tags surround the line."""
    global _recorded
    with open(file, encoding="utf-8") as lines:
        s, _, _, heading, curvature = np.array([[float(v) for v in row] for row in csv.reader(line for line in lines if line[0] in "-0123456789")]).T
    way = np.diff(s) * np.maximum(1, np.abs(curvature[:-1]) / most_curvature)
    points = np.vstack([[0, 0], np.cumsum(way[:, None] * np.column_stack([np.cos(heading[:-1]), np.sin(heading[:-1])]), axis=0)])
    for _ in range(20):
        points[1:-1] = (points[:-2] + 2 * points[1:-1] + points[2:]) / 4
    along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.arange(0, along[-1], 0.01)
    x, y = np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])
    yaw = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
    ends = np.clip(np.arange(len(at))[:, None] + [-5, 5], 0, len(at) - 1)
    _recorded = np.column_stack([x, y, yaw, (yaw[ends[:, 1]] - yaw[ends[:, 0]]) / (0.01 * (ends[:, 1] - ends[:, 0]))])
    _standing.cache_clear()


@contextlib.contextmanager
def recorded(file: pathlib.Path):
    """Uses the recorded line temporarily."""
    global _recorded
    use_recorded(file)
    try:
        yield
    finally:
        _recorded = None
        _standing.cache_clear()


def closed() -> bool:
    return _recorded is None


def length_m() -> float:
    return 0.01 * len(lap())


def lap() -> np.ndarray:
    """The line as rows of x, y, yaw, curvature, one per centimetre."""
    return _own_lap() if _recorded is None else _recorded


@functools.lru_cache
def _own_lap() -> np.ndarray:
    """Counter-clockwise, as long as LAP_M."""
    angle = np.linspace(0, 2 * math.pi, 20001)
    both_hands = 1 + 0.24 * np.cos(2 * angle) + 0.07 * np.sin(3 * angle) + 0.04 * np.cos(angle)
    radius = 1 + 0.12 * np.cos(2 * angle) if _one_sided else both_hands
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    way = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    scale = LAP_M / way[-1]
    at = np.arange(0, LAP_M, 0.01)
    x, y = np.interp(at, scale * way, scale * x), np.interp(at, scale * way, scale * y)
    dx, dy = (np.roll(x, -1) - np.roll(x, 1)) / 0.02, (np.roll(y, -1) - np.roll(y, 1)) / 0.02
    yaw = np.unwrap(np.arctan2(dy, dx))
    turn = np.roll(yaw, -5) - np.roll(yaw, 5)
    curvature = (turn - 2 * math.pi * np.round(turn / (2 * math.pi))) / 0.10
    return np.column_stack([x, y, yaw, curvature])


def _beside(at_m: float, left_m: float, z_m: float, number: int, turn_rad: float) -> Tag:
    x, y, yaw, _ = lap()[round(at_m / 0.01) % len(lap())]
    return Tag(number, x - left_m * math.sin(yaw), y + left_m * math.cos(yaw), z_m, frames.wrap(yaw + math.pi + turn_rad))


def _seen_from(tag: Tag) -> np.ndarray:
    """For each 0.1 m of the lap, whether a camera that looks ahead has a good view of the tag."""
    x, y, yaw = lap()[::10, :3].T
    dx, dy = tag.x_m - x, tag.y_m - y
    ahead, left = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    away = np.hypot(dx, dy)
    towards = -(math.cos(tag.facing_rad) * dx + math.sin(tag.facing_rad) * dy) / away
    return (ahead > 0.5) & (np.abs(left) < 0.6 * ahead) & (away < 2.8) & (towards > 0.5)


@functools.lru_cache
def _standing() -> tuple[Tag, ...]:
    """Two tags form the gate, if there is one. Each further tag is placed where it gives three visible tags to most of the lap."""
    half = GATE_M / 2 + TAG_SIZE_M * 10 / 8 / 2  # the gap is between the sheets of paper
    gate = [_beside(8.0, half, 0.25, TAGS - 2, -0.15), _beside(8.0, -half, 0.25, TAGS - 1, 0.15)] if closed() else []
    rng = np.random.default_rng(24)
    places = [_beside(rng.uniform(0, length_m()), rng.uniform(-1.3, 1.3), rng.uniform(0.16, 0.34), -1, rng.uniform(-0.5, 0.5))
              for _ in range(2500)]
    places = [tag for tag in places if _distance_to_lap(tag) > 0.55]
    views = np.array([_seen_from(tag) for tag in places])
    count = sum((_seen_from(tag).astype(int) for tag in gate), np.zeros(len(lap()[::10]), int))
    chosen: list[Tag] = []
    for number in range(TAGS - len(gate)):
        apart = [min((math.hypot(tag.x_m - other.x_m, tag.y_m - other.y_m) for other in gate + chosen), default=math.inf) > 0.45 for tag in places]
        gain = (views * np.where(count < 3, 4.0 ** -count, 0)).sum(axis=1) * np.array(apart)
        if number == ANCHOR:  # in view at the start of the lap, and at the end of a closed one
            gain = gain * (views[:, 0] & views[:, 5] & (views[:, -5] | (not closed())))
        if not gain.any():  # three tags in view everywhere
            break
        best = int(np.argmax(gain))
        chosen.append(dataclasses.replace(places[best], number=number))
        count = count + views[best]
    return tuple(chosen + gate)


def tags(anchor_lean_rad: float = 0.0, count: int = TAGS) -> tuple[Tag, ...]:
    """A subset keeps the gate and the tags that are visible from most of the lap. With 15, a third of the lap sees only one; with 10, 7 % see none."""
    standing = _standing()
    if count < len(standing):
        standing = standing[:max(1, count - 2)] + standing[-2:]
    return tuple(dataclasses.replace(tag, lean_rad=anchor_lean_rad) if tag.number == ANCHOR else tag for tag in standing)


def _distance_to_lap(tag: Tag) -> float:
    return float(np.min(np.hypot(lap()[:, 0] - tag.x_m, lap()[:, 1] - tag.y_m)))


def world_yaml(count: int = TAGS) -> str:
    """The course as a Waymark world file, for a lap that is taught fast."""
    lines = ["name: plant", "tag_family: tag36h11", f"tag_size_m: {TAG_SIZE_M}", f"anchor_id: {ANCHOR}", "tags:"]
    lines += [f"  - {{id: {tag.number}, x_m: {tag.x_m:.5f}, y_m: {tag.y_m:.5f}, z_m: {tag.z_m:.5f}, "
              f"facing_deg: {math.degrees(tag.facing_rad):.4f}}}" for tag in tags(count=count)]
    lines += [f"path_closed: {str(closed()).lower()}", "path_m:"]
    lines += [f"  - [{x:.4f}, {y:.4f}]" for x, y in lap()[::20 if closed() else 5, :2]]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Write the course as a world file.")
    parser.add_argument("output", type=pathlib.Path)
    parser.parse_args().output.write_text(world_yaml())
