"""Laps of the course as CSV tables, with injected causes (`map_causes.py`): one or two laps of a robot with wheels and gyro, 10 images a second,
Gaussian corners, prints that differ in size."""
import dataclasses
import math
import pathlib

import numpy as np

import body
import corner_camera
import course
import frames
import generate_log
import kinematic_plant
import map_causes
import sensors
from drive import Disturbance, DriveOptions
from map_causes import Cause, Truth
from teacher import Teacher

TICK_S = 0.01
IMAGE_TICKS = 10
SPEED_M_S = 0.35
CORNER_SIGMA_PX = 0.3
GAUSSIAN = corner_camera.CornerOptions(sigma_px=CORNER_SIGMA_PX, degrees_of_freedom=math.inf, lasting_m=0.0, miss=0.02)
MISREAD_SHARE = (0.002, 0.03)
OFFSET_S = (0.03, 0.4)
OTHER_CLOCK_S = 3600.0
LEAST_OBSERVATIONS = 8  # of a moved tag at each of its places


@dataclasses.dataclass
class Drive:
    tables: dict[str, list[str]]
    image_s: list[float]
    poses: list[np.ndarray]  # world_T_base of each image


@dataclasses.dataclass
class World:
    """The tags, after the move if there is one. `reads`: ids that differ from the number of the tag."""
    tags: list[course.Tag]
    earlier: list[course.Tag]
    moved: int = -1  # the tag that no image shows while it is moved
    left_at_s: float = -math.inf
    moved_at_s: float = -math.inf
    reads: dict[int, int] = dataclasses.field(default_factory=dict)


def drive(laps: int, odometry: str, seed: int) -> Drive:
    x, y, yaw, _ = course.lap()[0]
    plant = kinematic_plant.KinematicPlant((x, y, yaw), DriveOptions(), kinematic_plant.KinematicOptions(), seed)
    sensing, teacher = sensors.Sensors(sensors.SensorOptions(odometry=odometry), seed), Teacher(SPEED_M_S, seed, laps=laps)
    found = Drive({"odometry": ["t_ns,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s"],
                   "imu": ["t_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"]}, [], [])
    command, ticks = (0.0, 0.0), 0
    while not teacher.done:
        ticks += 1
        now = ticks * TICK_S
        plant.advance(*command, TICK_S, Disturbance())
        motion = plant.motion()
        sensing.advance(motion, TICK_S)
        imu = sensing.imu(motion)
        found.tables["imu"].append(generate_log.row(now, *imu["angular_velocity_rad_s"], *imu["linear_acceleration_m_s2"]))
        if ticks % 2 == 0:
            found.tables["odometry"].append(generate_log.row(now, *sensing.odometry(motion, 2 * TICK_S).values()))
            command = teacher.command(motion.x_m, motion.y_m, motion.yaw_rad, motion.yaw_rate_rad_s, 2 * TICK_S)
        if ticks % IMAGE_TICKS == 0:
            found.image_s.append(now)
            found.poses.append(generate_log.base_pose(motion))
    return found


def seen_at(driven: Drive, camera: body.Camera, tag: course.Tag) -> list[float]:
    """Times of the images that show the tag."""
    looking = corner_camera.CornerCamera(camera, (tag,), dataclasses.replace(GAUSSIAN, miss=0.0), 0)
    return [now for now, pose in zip(driven.image_s, driven.poses) if looking.look(frames.inverse(pose @ camera.base_T_camera()))]


def move(world: World, number: int, driven: Drive, camera: body.Camera, rng: np.random.Generator) -> Cause:
    """Moves a tag between two of its observations."""
    tag = world.tags[number]
    times = seen_at(driven, camera, tag)
    while True:
        by_m, angle, turn = rng.uniform(0.03, 0.4), rng.uniform(0, 2 * math.pi), rng.uniform(-0.2, 0.2)
        after = dataclasses.replace(tag, x_m=tag.x_m + by_m * math.cos(angle), y_m=tag.y_m + by_m * math.sin(angle), facing_rad=tag.facing_rad + turn)
        at_s = times[int(rng.uniform(0.25, 0.75) * len(times))] - 0.5 * TICK_S
        until_s = at_s + rng.uniform(*map_causes.HIDDEN_S)
        if sum(now > until_s for now in seen_at(driven, camera, after)) >= LEAST_OBSERVATIONS:
            break
    world.earlier = list(world.tags)
    world.tags[number], world.moved, world.left_at_s, world.moved_at_s = after, number, at_s, until_s
    return Cause("moved", str(number), f"by {by_m:.3f} m at {at_s:.1f} s")


def mount(rng: np.random.Generator) -> tuple[body.Camera, list[Cause]]:
    """The true camera, which differs from the robot file in position or rotation."""
    assumed = body.Camera()
    if rng.random() < 0.5:
        forward, left = rng.choice([-1, 1], 2) * rng.uniform(0.01, 0.05, 2)
        camera = dataclasses.replace(assumed, x_m=assumed.x_m + forward, y_m=assumed.y_m + left)
        return camera, [Cause("mounting", "cam", f"{forward:+.3f} {left:+.3f} m")]
    roll, pitch, yaw = rng.choice([-1, 1], 3) * np.radians(rng.uniform(0.5, 4.0, 3))
    camera = dataclasses.replace(assumed, roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw)
    return camera, [Cause("mounting", "cam", "{:+.1f} {:+.1f} {:+.1f} deg".format(*np.degrees([roll, pitch, yaw])))]


def inject(kinds: list[str], world: World, driven: Drive, camera: body.Camera, rng: np.random.Generator) -> list[Cause]:
    """Causes that concern tags. Each concerns other tags; the anchor is as likely as any other."""
    causes = []
    numbers = [int(number) for number in rng.permutation(course.TAGS)]
    if "moved" in kinds:
        number = next(n for n in numbers if len(seen_at(driven, camera, world.tags[n])) >= 3 * LEAST_OBSERVATIONS)
        numbers.remove(number)
        causes.append(move(world, number, driven, camera, rng))
    if "size" in kinds:
        number, scale = numbers.pop(), map_causes.draw_size(rng)
        for tags in (world.tags, world.earlier):
            tags[number] = dataclasses.replace(tags[number], size_m=scale * tags[number].size_m)
        causes.append(Cause("size", str(number), f"{100 * (scale - 1):+.1f} %"))
    if "duplicate" in kinds:
        number = numbers.pop()
        copy = next(other for other in numbers if other != course.ANCHOR)
        world.reads[copy] = number
        apart_m = np.linalg.norm((world.tags[number].world_T_tag() - world.tags[copy].world_T_tag())[:3, 3])
        causes.append(Cause("duplicate", str(number), f"{apart_m:.1f} m apart"))
    return causes


def detections(world: World, driven: Drive, camera: body.Camera, late_s: float, misread_share: float, rng: np.random.Generator) -> list[str]:
    lines = ["t_ns,camera,tag,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_y_px,hamming,decision_margin"]
    seed = int(rng.integers(1 << 31))
    before, after = (corner_camera.CornerCamera(camera, tuple(tags), GAUSSIAN, seed + k) for k, tags in enumerate((world.earlier, world.tags)))
    for now, pose in zip(driven.image_s, driven.poses):
        looking = before if now < world.moved_at_s else after
        for seen in looking.look(frames.inverse(pose @ camera.base_T_camera())):
            number = int(seen["tag"].split(":")[1])
            if number == world.moved and world.left_at_s <= now < world.moved_at_s:
                continue
            number = world.reads.get(number, number)
            if rng.random() < misread_share:
                number = map_causes.misread(number, course.TAGS, rng)
            lines.append(generate_log.row(now + late_s, "cam", f"tag36h11:{number}", *np.ravel(seen["corners_px"]), 0, 60))
    return lines


def write(folder: pathlib.Path, seed: int, choice: str) -> Truth:
    """Writes detections.csv, odometry.csv, imu.csv and robot.yaml. `choice`: of `map_causes.CHOICES`."""
    rng = np.random.default_rng([seed, 21, map_causes.CHOICES.index(choice)])
    kinds = map_causes.draw_kinds(choice, rng)
    driven = drive(int(rng.integers(1, 3)), str(rng.choice(["gyro", "wheels"])), seed)
    camera, causes = mount(rng) if "mounting" in kinds else (body.Camera(), [])
    sizes = map_causes.print_sizes(course.TAGS, rng)
    tags = [dataclasses.replace(tag, size_m=tag.size_m * scale) for tag, scale in zip(sorted(course.tags(), key=lambda tag: tag.number), sizes)]
    world = World(tags, list(tags))
    causes += inject(kinds, world, driven, camera, rng)
    late_s, share = 0.0, 0.0
    if "clock" in kinds:
        late_s = OTHER_CLOCK_S if rng.random() < 0.1 else float(rng.choice([-1, 1]) * rng.uniform(*OFFSET_S))
        causes.append(Cause("clock", "camera|odometry|images", f"{late_s:+.3f} s"))
    if "misread" in kinds:
        share = float(rng.uniform(*MISREAD_SHARE))
        causes.append(Cause("misread", "", f"{100 * share:.1f} %"))
    driven.tables["detections"] = detections(world, driven, camera, late_s, share, rng)
    folder.mkdir(parents=True, exist_ok=True)
    for name, lines in driven.tables.items():
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    (folder / "robot.yaml").write_text(body.robot_yaml(body.Camera()))
    places: dict[int, list[np.ndarray]] = {}
    for tag in world.tags:
        places.setdefault(world.reads.get(tag.number, tag.number), []).append(tag.world_T_tag()[:3, 3])
    stamps_ns = np.round((np.array(driven.image_s) + generate_log.START_S + late_s) * 1e9)
    return Truth(causes, places, stamps_ns, np.array(driven.poses))


def command(folder: pathlib.Path) -> list[str]:
    """The words after `waymark`. The anchor has its true pose before a move."""
    anchor = next(tag for tag in course.tags() if tag.number == course.ANCHOR)
    pose = [anchor.x_m, anchor.y_m, anchor.z_m, -90, 0, math.degrees(anchor.facing_rad) + 90]
    tables = [str(folder / f"{name}.csv") for name in ("detections", "odometry", "imu")]
    return ["map", "lap", *tables, "--robot", str(folder / "robot.yaml"), "--tag-size-m", str(course.TAG_SIZE_M), "--anchor", str(course.ANCHOR),
            "--anchor-pose", *map(str, pose), "-o", str(folder / "out"), "--json"]
