#!/usr/bin/python3
"""Rooms in which tags carry one id twice, were moved, or neither, as TagSLAM's files and a ROS 2 bag of detections. A hand-held rig of one or two
cameras walks through a room of 8 m by 6 m with tags of 16 cm on its walls: 10 Hz, 640 x 480, corner noise 0.2 px, detections lost at random."""
import dataclasses
import math
import pathlib
import sys
import typing

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import frames
import ros2_bag

TAG_M = 0.16
FX, CX, CY, WIDTH, HEIGHT = 480.0, 319.5, 239.5, 640, 480  # as ROS: pixel centres at integers
HALF_X, HALF_Y = 4.0, 3.0  # half of the room
ROUND_FRAMES = 300
STEP_NS = 100_000_000
START_NS = 1_700_000_000_000_000_000
ODOMETRY_M, ODOMETRY_RAD = 0.002, 0.001  # noise per frame
CORNERS = TAG_M / 2 * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])  # TL, TR, BR, BL

CASES = {
    "clean": "no duplicate, two rounds",
    "clean-misread": "no duplicate, one per cent of the ids misread",
    "far": "two prints on opposite walls, two rounds",
    "far-one": "two prints on opposite walls, observed once each (three quarters of a round)",
    "far-2cam": "two prints on opposite walls, two cameras",
    "near": "two prints about 1 m apart, in one image",
    "touching": "two prints 0.2 m apart, always in one image",
    "faces": "two prints on the two faces of a board in the middle",
    "anchor": "the only tag with a given pose is duplicated",
    "no-anchor": "no tag has a given pose; one is duplicated",
    "three": "three prints of one id",
    "two-ids": "two ids with two prints each",
    "misread": "two prints, and one per cent of the ids misread",
    "moved-near": "a tag was moved by 0.3 m between two rounds",
    "moved-far": "a tag was moved across the room between two rounds",
    "moved-back": "a tag was moved across the room before the second of three rounds, and returned before the third",
    "trolley": "a tag at another place in each of eight rounds",
    "odometry": "two prints on opposite walls, with odometry",
    "odometry-jump": "no duplicate; odometry is wrong by 5 m between two rounds",
}
ROUNDS = {"far-one": 0.75, "moved-back": 3, "trolley": 8}
DUPLICATES = {"far": [[9]], "far-one": [[14]], "far-2cam": [[9]], "near": [[1]], "no-anchor": [[9]], "three": [[8, 16]], "two-ids": [[10], [10]],
              "misread": [[9]], "odometry": [[9]]}  # for each duplicated id, the steps along the wall to its other prints


@dataclasses.dataclass
class Scene:
    """`images`: for each frame and camera, pairs of an id and its corners. `places`: of each id, its prints in the last round."""
    case: str
    given: dict[int, np.ndarray]
    rig_T_cameras: list[np.ndarray]
    images: list[list[list[tuple[int, np.ndarray]]]]
    map_T_rig: list[np.ndarray]
    odom_T_rig: list[np.ndarray]
    places: dict[int, list[np.ndarray]]
    duplicates: list[int]
    moved: list[int]


def facing(position, normal, roll=0.0) -> np.ndarray:
    """map_T_tag of a tag with this outward normal."""
    z = np.asarray(normal, float) / np.linalg.norm(normal)
    x = np.cross([0, 0, 1], z)
    x /= np.linalg.norm(x)
    c, s = math.cos(roll), math.sin(roll)
    turned = np.column_stack([x, np.cross(z, x), z]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return frames.rigid(turned, np.asarray(position, float))


def on_wall(s_m, rng) -> np.ndarray:
    """A tag on the walls at this arc length."""
    s_m %= 4 * (HALF_X + HALF_Y)
    z = rng.uniform(0.7, 1.9)
    tilt, roll = 0.15 * rng.normal(size=3), rng.uniform(-0.3, 0.3)
    for start, direction, length in (((-HALF_X, -HALF_Y), (1, 0), 2 * HALF_X), ((HALF_X, -HALF_Y), (0, 1), 2 * HALF_Y),
                                     ((HALF_X, HALF_Y), (-1, 0), 2 * HALF_X), ((-HALF_X, HALF_Y), (0, -1), 2 * HALF_Y)):
        if s_m < length:
            return facing([start[0] + s_m * direction[0], start[1] + s_m * direction[1], z], np.array([-direction[1], direction[0], 0]) + tilt, roll)
        s_m -= length
    raise ValueError("beyond the walls")


def camera_at(position, forward, roll) -> np.ndarray:
    """map_T_cam with x to the right, y down and z forward."""
    z = np.asarray(forward, float) / np.linalg.norm(forward)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x)
    c, s = math.cos(roll), math.sin(roll)
    return frames.rigid(np.column_stack([x, np.cross(z, x), z]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.asarray(position, float))


def walker(case, phase, rng) -> typing.Callable[[float], np.ndarray]:
    """The pose of the rig at a frame, which may be between two images."""
    wave = rng.uniform(0, 2 * math.pi, 6)

    def pose(frame: float) -> np.ndarray:
        t = frame * STEP_NS / 1e9
        a = phase + 2 * math.pi * frame / ROUND_FRAMES
        at = [1.3 * math.cos(a) + 0.1 * math.sin(1.3 * t + wave[0]), 0.9 * math.sin(a) + 0.1 * math.sin(1.1 * t + wave[1]),
              1.35 + 0.1 * math.sin(0.9 * t + wave[2])]
        look = a + 0.5 * math.sin(0.8 * t + wave[3]) - 0.35
        forward = [math.cos(look), math.sin(look), 0.15 * math.sin(0.7 * t + wave[4])]
        if case == "faces" and math.sin(2 * a + 0.7) > 0.2:  # looks at the board from both sides
            forward = np.array([0.45 + 0.4 * math.sin(t), 0.2, 1.3]) - at
        return camera_at(at, forward, 0.15 * math.sin(0.6 * t + wave[5]))

    return pose


def walk(rounds, case, rng) -> list[np.ndarray]:
    """The poses of the rig."""
    pose = walker(case, rng.uniform(0, 2 * math.pi) if rounds >= 1 else 0.0, rng)
    return [pose(frame) for frame in range(int(ROUND_FRAMES * rounds))]


def image_of(map_T_cam, map_T_tag, scale=1.0) -> np.ndarray | None:
    """The corners of a tag [px] if the camera detects it. `scale`: its printed size over TAG_M."""
    to_camera = map_T_cam[:3, 3] - map_T_tag[:3, 3]
    if map_T_tag[:3, 2] @ to_camera < 0.3 * np.linalg.norm(to_camera):
        return None
    in_camera = (scale * CORNERS @ map_T_tag[:3, :3].T - to_camera) @ map_T_cam[:3, :3]
    if in_camera[:, 2].min() < 0.1:
        return None
    px = FX * in_camera[:, :2] / in_camera[:, 2:] + [CX, CY]
    inside = (px > 3).all() and (px < [WIDTH - 4, HEIGHT - 4]).all()
    sides = np.linalg.norm(px - np.roll(px, 1, axis=0), axis=1)
    return px if inside and sides.min() >= 12 else None


def prints(case, rounds, rng) -> tuple[list[tuple[int, list[np.ndarray]]], list[int], list[int]]:
    """Each print as its id and its poses by round; the duplicated ids; the moved ones."""
    count = 40 if case == "far-one" else 28
    poses = [on_wall(4 * (HALF_X + HALF_Y) * (i + rng.uniform(0.3, 0.7)) / count, rng) for i in range(count)]
    tags = [(i, [pose] * math.ceil(rounds)) for i, pose in enumerate(poses)]
    base = int(rng.integers(5, 8))
    duplicates, moved = [], []
    for k, steps in enumerate(DUPLICATES.get(case, [])):
        duplicates.append(base + 3 * k)
        for step in steps:
            tags[base + 3 * k + step] = (base + 3 * k, tags[base + 3 * k + step][1])
    if case == "anchor":
        duplicates.append(0)
        tags[12] = (0, tags[12][1])
    if case == "touching":
        duplicates.append(base)
        tags.append((base, [poses[base] @ frames.rigid(np.eye(3), np.array([0.2, 0, 0]))] * math.ceil(rounds)))
    if case == "faces":
        duplicates.append(count)
        for x_m, numbers in ((0.3, (count, count)), (0.6, (count + 1, count + 2))):
            tags += [(number, [facing([x_m, 0.2 + 0.004 * side, 1.3], [0, side, 0])] * math.ceil(rounds)) for side, number in zip((1, -1), numbers)]
    if case == "moved-near":
        moved.append(base)
        tags[base] = (base, [poses[base], poses[base] @ frames.rigid(np.eye(3), np.array([0.24, 0.18, 0]))])
    if case in ("moved-far", "moved-back"):
        moved += [base] if case == "moved-far" else []
        there = on_wall(14 + base, rng)
        tags[base] = (base, [poses[base], there, poses[base]][:math.ceil(rounds)])
    if case == "trolley":
        tags[base] = (base, [on_wall(3.4 * k + 0.5, rng) for k in range(math.ceil(rounds))])
    return tags, duplicates, moved


def drift(poses, jump_m, rng) -> list[np.ndarray]:
    """Odometry along these poses, with noise, and wrong by a motion in the middle."""
    odometry = [np.eye(4)]
    for i in range(1, len(poses)):
        step = np.linalg.inv(poses[i - 1]) @ poses[i]
        noise = frames.rigid(rotation(ODOMETRY_RAD * rng.normal(size=3)), ODOMETRY_M * rng.normal(size=3))
        if i == len(poses) // 2:
            noise[0, 3] += jump_m
        odometry.append(odometry[-1] @ step @ noise)
    return odometry


def rotation(vector) -> np.ndarray:
    """The matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = np.asarray(vector) / max(angle, 1e-12)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def build(case: str, seed: int) -> Scene:
    """The first scene of this seed in which each print and the tag with a given pose are observed."""
    for attempt in range(50):
        scene, observed = build_once(case, np.random.default_rng([list(CASES).index(case), seed, attempt]))
        if min(observed) >= 10:
            return scene
    raise RuntimeError(f"{case} {seed}: no scene shows each print")


def build_once(case, rng) -> tuple[Scene, list[int]]:
    rounds = ROUNDS.get(case, 2)
    tags, duplicates, moved = prints(case, rounds, rng)
    poses = walk(rounds, case, rng)
    turn = 0.9
    second = frames.rigid(np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]]), np.array([0.12, 0.01, -0.03]))
    cameras = [np.eye(4)] + ([second] if case == "far-2cam" else [])
    images, of_print = [], [0] * len(tags)
    for f, pose in enumerate(poses):
        images.append([detect(pose @ camera, f // ROUND_FRAMES, tags, "misread" in case, of_print, rng) for camera in cameras])
    seen = [number for number, _ in (pair for views in images for view in views for pair in view)]
    places: dict[int, list[np.ndarray]] = {}
    for number, by_round in tags:
        if case == "trolley" and len({pose.tobytes() for pose in by_round}) > 1:
            continue  # it may be at any place, or not in the map
        if seen.count(number) >= 8:
            places.setdefault(number, []).append(by_round[-1][:3, 3])
    given = {} if case == "no-anchor" else {0: tags[0][1][0]}
    odometry = drift(poses, 5.0 if case == "odometry-jump" else 0.0, rng) if case.startswith("odometry") else []
    required = [n for (number, _), n in zip(tags, of_print) if number in duplicates + moved + list(given)]
    return Scene(case, given, cameras, images, poses, odometry, places, duplicates, moved), required or [10]


def detect(map_T_cam, at_round, tags, misread, of_print, rng) -> list[tuple[int, np.ndarray]]:
    """Counts the detections of each print."""
    seen = []
    for k, (number, by_round) in enumerate(tags):
        px = image_of(map_T_cam, by_round[at_round])
        if px is None or rng.random() < 0.06:
            continue
        read = int((number + 1 + rng.integers(20)) % 28) if misread and rng.random() < 0.01 else number
        seen.append((read, px + rng.normal(0, 0.2, px.shape)))
        of_print[k] += 1
    rng.shuffle(seen)
    return seen


def xyz(vector) -> str:
    return "{x: %.12g, y: %.12g, z: %.12g}" % tuple(vector)


def yaml_pose(pose) -> str:
    rotation_rad = frames.rotation_vector(pose[:3, :3])
    noise = "{x: 1e-4, y: 1e-4, z: 1e-4}"
    return f"pose: {{position: {xyz(pose[:3, 3])}, rotation: {xyz(rotation_rad)}, position_noise: {noise}, rotation_noise: {noise}}}"


def odometry_message(ns, odom_T_rig) -> bytes:
    vector = frames.rotation_vector(odom_T_rig[:3, :3])
    angle = float(np.linalg.norm(vector))
    imaginary = vector * (math.sin(angle / 2) / angle if angle > 0 else 0.5)
    message = ros2_bag.Message().header(ns, "odom").text("rig_odom")
    message.put("d", *odom_T_rig[:3, 3], *imaginary, math.cos(angle / 2), *[0] * 36)
    return message.put("d", *[0] * 42).bytes()


def write(folder: pathlib.Path, scene: Scene) -> None:
    """Writes tagslam.yaml, cameras.yaml, camera_poses.yaml and tags.db3."""
    folder.mkdir(parents=True, exist_ok=True)
    odometry = f", odom_frame_id: rig_odom, odom_translation_noise: {ODOMETRY_M}, odom_rotation_noise: {ODOMETRY_RAD}" if scene.odom_T_rig else ""
    lines = ["tagslam_parameters: {pixel_noise: 1.0}", "body_defaults: {position_noise: 0.001, rotation_noise: 0.001}", "default_body: room",
             "bodies:", " - room:", "     is_static: true", "     type: simple", f"     default_tag_size: {TAG_M}"]
    if scene.given:
        lines += ["     " + yaml_pose(np.eye(4)), "     tags:"]
        lines += [f"       - {{id: {number}, size: {TAG_M}, {yaml_pose(pose)}}}" for number, pose in scene.given.items()]
    lines += [f" - rig: {{is_static: false, type: simple{odometry}}}"]
    (folder / "tagslam.yaml").write_text("\n".join(lines) + "\n")
    (folder / "cameras.yaml").write_text("".join(
        f"cam{c}: {{camera_model: pinhole, intrinsics: [{FX}, {FX}, {CX}, {CY}], distortion_model: radtan, distortion_coeffs: [0, 0, 0, 0], "
        f"resolution: [{WIDTH}, {HEIGHT}], tagtopic: /cam{c}/tags, rig_body: rig}}\n" for c in range(len(scene.rig_T_cameras))))
    (folder / "camera_poses.yaml").write_text("".join(f"cam{c}: {{{yaml_pose(pose)}}}\n" for c, pose in enumerate(scene.rig_T_cameras)))
    messages = []
    for f, views in enumerate(scene.images):
        ns = START_NS + f * STEP_NS
        if scene.odom_T_rig:
            messages.append((ns, "/odom", ros2_bag.ODOMETRY, odometry_message(ns, scene.odom_T_rig[f])))
        messages += [(ns, f"/cam{c}/tags", ros2_bag.DETECTIONS, ros2_bag.detections(ns, f"cam{c}", seen)) for c, seen in enumerate(views)]
    ros2_bag.write(folder / "tags.db3", messages)
