"""Rooms of `duplicate_scenes.py` with injected causes (`map_causes.py`): one or two cameras, with or without odometry, prints that differ in size."""
import dataclasses
import math
import pathlib

import numpy as np

import duplicate_scenes
import frames
import map_causes
from duplicate_scenes import ROUND_FRAMES, START_NS, STEP_NS
from map_causes import Cause, Truth

TAGS = 28
GIVEN = 0
ROUNDS = 2
CORNER_SIGMA_PX, MISS = 0.2, 0.06
MISREAD_SHARE = (0.002, 0.03)
OFFSET_FRAMES = (0.2, 4.0)
LEAST_OBSERVATIONS = 10
RIG_T_SECOND = frames.rigid(frames.rotation(1, 0.9), (0.12, 0.01, -0.03))


@dataclasses.dataclass
class Print:
    number: int
    scale: float  # its printed size over the given size
    earlier: np.ndarray  # map_T_tag before it is moved
    pose: np.ndarray
    left_at: int = 0  # the first frame that is not at `earlier`
    moved_at: int = 0  # the first frame at `pose`; no image shows the print between both

    def at(self, frame: int) -> np.ndarray:
        return self.pose if frame >= self.moved_at else self.earlier

    def image(self, map_T_cam: np.ndarray, frame: int) -> np.ndarray | None:
        hidden = self.left_at <= frame < self.moved_at
        return None if hidden else duplicate_scenes.image_of(map_T_cam, self.at(frame), self.scale)


@dataclasses.dataclass
class Rig:
    """`late`: frames by which each camera's stamps, and those of odometry, are late."""
    true: list[np.ndarray]  # rig_T_cam
    given: list[np.ndarray]
    late: list[float]
    has_odometry: bool = False
    odometry_late: float = 0.0


def views_of(pose, rig: Rig, tag: Print) -> list[int]:
    """The frames whose images show the print."""
    return [f for f in range(ROUNDS * ROUND_FRAMES) if any(
        tag.image(pose(f - late) @ camera, f) is not None for camera, late in zip(rig.true, rig.late))]


def draw_rig(kinds: list[str], rng: np.random.Generator) -> tuple[Rig, list[Cause]]:
    causes = []
    two = "mounting" in kinds or rng.random() < 0.5
    cameras = [np.eye(4)] + ([RIG_T_SECOND] if two else [])
    rig = Rig(list(cameras), cameras, [0.0] * len(cameras), has_odometry=rng.random() < 0.5)
    if "mounting" in kinds:
        shift, turn = 0.03 * rng.standard_normal(3), math.radians(1.5) * rng.standard_normal(3)
        rig.true[1] = rig.true[1] @ frames.rigid(duplicate_scenes.rotation(turn), shift)
        causes.append(Cause("mounting", "cam1", f"{1000 * np.linalg.norm(shift):.0f} mm {math.degrees(np.linalg.norm(turn)):.1f} deg"))
    if "clock" in kinds:
        late = float(rng.choice([-1, 1]) * rng.uniform(*OFFSET_FRAMES))
        of_camera = two and rng.random() < 0.5
        if of_camera:
            rig.late[1] = late
        else:
            rig.has_odometry, rig.odometry_late = True, late
        causes.append(Cause("clock", "cam1" if of_camera else "odometry", f"{late * STEP_NS / 1e9:+.3f} s"))
    return rig, causes


def move(tag: Print, pose, rig: Rig, rng: np.random.Generator) -> Cause:
    """Moves a print between two of its observations, by centimetres or to another place on the walls."""
    frames_before = views_of(pose, rig, tag)
    while True:
        if rng.random() < 0.7:
            by_m, angle = rng.uniform(0.03, 0.4), rng.uniform(0, 2 * math.pi)
            after = tag.earlier @ frames.rigid(frames.rotation(2, rng.uniform(-0.2, 0.2)), (by_m * math.cos(angle), by_m * math.sin(angle), 0))
        else:
            after = duplicate_scenes.on_wall(rng.uniform(0, 28), rng)
        at = frames_before[int(rng.uniform(0.25, 0.75) * len(frames_before))]
        until = at + int(rng.uniform(*map_causes.HIDDEN_S) * 1e9 / STEP_NS)
        moved = dataclasses.replace(tag, pose=after, left_at=at, moved_at=until)
        if sum(f >= until for f in views_of(pose, rig, moved)) >= LEAST_OBSERVATIONS:
            break
    tag.pose, tag.left_at, tag.moved_at = after, at, until
    return Cause("moved", str(tag.number), f"by {np.linalg.norm(after[:3, 3] - tag.earlier[:3, 3]):.3f} m at {at * STEP_NS / 1e9:.1f} s")


def inject(kinds: list[str], prints: list[Print], pose, rig: Rig, rng: np.random.Generator) -> list[Cause]:
    """Causes that concern tags. Each concerns other tags; the one with a given pose is as likely as any other."""
    causes = []
    order = [int(number) for number in rng.permutation(TAGS)]

    def observed(number: int) -> bool:
        return len(views_of(pose, rig, prints[number])) >= 3 * LEAST_OBSERVATIONS

    chosen = filter(observed, reversed(order))
    if "moved" in kinds:
        causes.append(move(prints[next(chosen)], pose, rig, rng))
    if "size" in kinds:
        number, scale = next(chosen), map_causes.draw_size(rng)
        prints[number].scale *= scale
        causes.append(Cause("size", str(number), f"{100 * (scale - 1):+.1f} %"))
    if "duplicate" in kinds:
        number = next(chosen)
        copy = next(other for other in filter(observed, order) if other not in (GIVEN, number))
        prints[copy].number = number
        causes.append(Cause("duplicate", str(number), f"{np.linalg.norm((prints[copy].pose - prints[number].pose)[:3, 3]):.1f} m apart"))
    return causes


def detect(map_T_cam, frame: int, prints: list[Print], misread_share: float, rng: np.random.Generator) -> list[tuple[int, np.ndarray]]:
    seen = []
    for tag in prints:
        px = tag.image(map_T_cam, frame)
        if px is None or rng.random() < MISS:
            continue
        number = map_causes.misread(tag.number, TAGS, rng) if rng.random() < misread_share else tag.number
        seen.append((number, px + rng.normal(0, CORNER_SIGMA_PX, px.shape)))
    rng.shuffle(seen)
    return seen


def resection_sigma_m(map_T_rig, rig: Rig, frame: int, prints: list[Print]) -> float:
    """Standard deviation of the rig's position by the corners of one frame, if the tags are exact: the program states none. Infinite without tags."""
    information = np.zeros((6, 6))
    for rig_T_cam in rig.true:
        cam_T_rig = frames.inverse(rig_T_cam)
        for tag in prints:
            if tag.image(map_T_rig @ rig_T_cam, frame) is None:
                continue
            in_map = duplicate_scenes.CORNERS @ tag.at(frame)[:3, :3].T + tag.at(frame)[:3, 3]
            for p in (in_map - map_T_rig[:3, 3]) @ map_T_rig[:3, :3]:
                x, y, z = cam_T_rig[:3, :3] @ p + cam_T_rig[:3, 3]
                by_point = duplicate_scenes.FX / z * np.array([[1, 0, -x / z], [0, 1, -y / z]]) @ cam_T_rig[:3, :3]
                J = by_point @ np.hstack([-np.eye(3), np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])])
                information += J.T @ J / CORNER_SIGMA_PX ** 2
    return float(np.sqrt(np.trace(np.linalg.inv(information)[:3, :3]))) if information.any() else math.inf


def write(folder: pathlib.Path, seed: int, choice: str) -> Truth:
    """The first scene of this seed in which the tag with a given pose is observed often enough, as TagSLAM's files and tags.db3. `choice`: of
    `map_causes.CHOICES`."""
    for attempt in range(50):
        rng = np.random.default_rng([seed, 22, map_causes.CHOICES.index(choice), attempt])
        kinds = map_causes.draw_kinds(choice, rng)
        pose = duplicate_scenes.walker("", rng.uniform(0, 2 * math.pi), rng)
        rig, causes = draw_rig(kinds, rng)
        walls_m = 4 * (duplicate_scenes.HALF_X + duplicate_scenes.HALF_Y)
        poses = [duplicate_scenes.on_wall(walls_m * (i + rng.uniform(0.3, 0.7)) / TAGS, rng) for i in range(TAGS)]
        prints = [Print(i, scale, at, at) for i, (scale, at) in enumerate(zip(map_causes.print_sizes(TAGS, rng), poses))]
        if len(views_of(pose, rig, prints[GIVEN])) >= 3 * LEAST_OBSERVATIONS:
            return record(folder, kinds, causes, pose, rig, prints, rng)
    raise RuntimeError(f"scene {seed}: no walk observes the tag with a given pose")


def record(folder: pathlib.Path, kinds, causes, pose, rig: Rig, prints: list[Print], rng: np.random.Generator) -> Truth:
    causes = causes + inject(kinds, prints, pose, rig, rng)
    share = float(rng.uniform(*MISREAD_SHARE)) if "misread" in kinds else 0.0
    if share:
        causes.append(Cause("misread", "", f"{100 * share:.1f} %"))
    numbers = range(ROUNDS * ROUND_FRAMES)
    walked = [pose(f) for f in numbers]
    images = [[detect(pose(f - late) @ camera, f, prints, share, rng) for camera, late in zip(rig.true, rig.late)] for f in numbers]
    odometry = duplicate_scenes.drift([pose(f - rig.odometry_late) for f in numbers], 0.0, rng) if rig.has_odometry else []
    places: dict[int, list[np.ndarray]] = {}
    for tag in prints:
        places.setdefault(tag.number, []).append(tag.pose[:3, 3])
    duplicate_scenes.write(folder, duplicate_scenes.Scene("", {GIVEN: prints[GIVEN].earlier}, rig.given, images, walked, odometry, places, [], []))
    deviations_m = [resection_sigma_m(walked[f], rig, f, prints) for f in numbers]
    ids = [{number for seen in images[f] for number, _ in seen} for f in numbers]
    return Truth(causes, places, np.array([START_NS + f * STEP_NS for f in numbers]), np.array(walked), deviations_m, ids)


def command(folder: pathlib.Path) -> list[str]:
    """The words after `waymark`."""
    return ["map", "scene", str(folder / "tags.db3"), "--tagslam", str(folder), "-o", str(folder / "out"), "--json"]
