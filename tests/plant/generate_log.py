#!/usr/bin/python3
"""A log with noise unlike that of any filter, as CSV tables (docs/formats/importing.md): t-distributed corners with persistent errors of
each tag, slip bursts, a drifting gyro bias, jittering stamps and a drifting latency. Also writes truth.csv, map.yaml and robot.yaml.

    tests/plant/generate_log.py log --seed 1 --mounting 0.02 0.03 0 0 0 2
    waymark localize log/detections.csv log/odometry.csv log/imu.csv --map log/map.yaml --robot log/robot.yaml -o log/estimate.mcap"""
import argparse
import dataclasses
import math
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import body
import corner_camera
import course
import frames
import kinematic_plant
import sensors
from drive import Disturbance, DriveOptions, Motion
from teacher import Teacher

TICK_S = 0.005
START_S = 100.0
SPEED_FOR_S = 10.0


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--clean", action="store_true", help="Gaussian corners, no persistent errors, drift, bursts or jitter")
    parser.add_argument("--turn-gain", type=float, default=0.6)
    parser.add_argument("--odometry", choices=["gyro", "wheels"], default="gyro")
    parser.add_argument("--mounting", type=float, nargs=6, default=[0.0] * 6, metavar=("X", "Y", "Z", "ROLL", "PITCH", "YAW"),
                        help="true camera minus that of robot.yaml [m, deg]")
    parser.add_argument("--focal-scale", type=float, default=1.0, help="true focal length over that of robot.yaml")
    parser.add_argument("--latency-s", type=float, default=0.0, help="delay of the image stamps")
    parser.add_argument("--tag-off", type=float, nargs=2, action="append", default=[], metavar=("NUMBER", "M"),
                        help="displacement of this tag in the map")
    parser.add_argument("--moved", type=float, nargs=2, metavar=("COUNT", "M"), default=[0, 0.0],
                        help="the map has so many tags, spread over the lap, so far from where they are, each in another direction")
    parser.add_argument("--moved-alike", action="store_true", help="with --moved: all of them in the same direction")
    parser.add_argument("--map-sigma-m", type=float, default=0.001, help="errors of the map's tags, which map.yaml states unless --no-covariance")
    parser.add_argument("--map-sigma-rad", type=float, default=0.002)
    parser.add_argument("--printing", type=int, default=0, help="which set of printed tags is used; each has its own printing errors")
    parser.add_argument("--no-covariance", action="store_true", help="map.yaml contains no covariances")
    parser.add_argument("--coarse", action="store_true", help="ranges and bearings with unknown noise instead of corners")
    parser.add_argument("--encoder-stuck", type=float, nargs=2, action="append", default=[], metavar=("AT_S", "FOR_S"),
                        help="interval in which the encoders report no motion")
    parser.add_argument("--jitter-s", type=float, default=0.0, help="maximum error of the image stamps, uniformly distributed")
    parser.add_argument("--second", type=int, nargs=2, action="append", default=[], metavar=("NUMBER", "AS"),
                        help="the tag of this number carries the other one, which another tag has, too")
    parser.add_argument("--one-sided", action="store_true", help="the lap is an oval, driven to the left")
    parser.add_argument("--imu-gap", type=float, nargs=2, action="append", default=[], metavar=("AT_S", "FOR_S"),
                        help="the table of the gyro has nothing meanwhile")
    parser.add_argument("--no-imu", action="store_true", help="without the table of the gyro")
    parser.add_argument("--image-rate-hz", type=float, default=15)
    parser.add_argument("--laps", type=float, default=1.0)
    parser.add_argument("--speeds", type=float, nargs="+", default=[0.3], metavar="M_S", help="of the drive, one after the other, ten seconds each")
    return parser.parse_args()


class SlipBursts:
    """Occasionally the wheels briefly lose half their grip."""

    def __init__(self, seed: int, on: bool):
        self._rng, self._on, self._until, self._now = np.random.default_rng([seed, 6]), on, 0.0, 0.0

    def grip(self, dt_s: float) -> float:
        self._now += dt_s
        if self._on and self._now > self._until and self._rng.random() < dt_s / 8.0:
            self._until = self._now + self._rng.uniform(0.2, 0.5)
        return 0.6 if self._now < self._until else 1.0


class Stamps:
    """The recorded stamp of an image."""

    def __init__(self, seed: int, latency_s: float, jitter_s: float, on: bool):
        self._rng, self._latency_s, self._on, self._wander = np.random.default_rng([seed, 7]), latency_s, on, 0.0
        self._jitter, self._jitter_s = np.random.default_rng([seed, 10]), jitter_s

    def of(self, time_s: float) -> float:
        time_s += self._jitter.uniform(-self._jitter_s, self._jitter_s)
        if not self._on:
            return time_s + self._latency_s
        self._wander = 0.98 * self._wander + 0.2 * 0.003 * self._rng.standard_normal()
        return time_s + self._latency_s + self._wander + 0.001 * self._rng.standard_normal()


def drive(args: argparse.Namespace) -> dict[str, list[str]]:
    """The lines of each table."""
    rough = not args.clean
    tags = course.tags()
    x, y, yaw, _ = course.lap()[0]
    motion_options = kinematic_plant.KinematicOptions(turn_gain=args.turn_gain, slip_noise=0.03 if rough else 0.0)
    plant = kinematic_plant.KinematicPlant((x, y, yaw), DriveOptions(), motion_options, args.seed)
    sensing = sensors.Sensors(sensors.SensorOptions(odometry=args.odometry, gyro_bias_walk=0.0006 if rough else 0.0), args.seed)
    assumed = body.Camera()
    roll, pitch, turn = (math.radians(angle) for angle in args.mounting[3:])
    camera = dataclasses.replace(assumed, fx_px=assumed.fx_px * args.focal_scale, fy_px=assumed.fy_px * args.focal_scale,
                                 x_m=assumed.x_m + args.mounting[0], y_m=assumed.y_m + args.mounting[1],
                                 z_m=assumed.z_m + args.mounting[2], roll_rad=roll, pitch_rad=pitch, yaw_rad=turn)
    corners = corner_camera.CornerOptions(printing=args.printing) if rough else corner_camera.CornerOptions(sigma_px=0.3 / math.sqrt(3), lasting_m=0.0)
    looking = corner_camera.CornerCamera(camera, tags, corners, args.seed)
    carries = {f"tag36h11:{number}": f"tag36h11:{other}" for number, other in args.second}
    coarse = np.random.default_rng([args.seed, 8])
    bursts, stamps, teacher = SlipBursts(args.seed, rough), Stamps(args.seed, args.latency_s, args.jitter_s, rough), Teacher(args.speeds[0], args.seed)
    tables: dict[str, list[str]] = {
        "odometry": ["t_ns,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s"], "truth": ["t_ns,x_m,y_m,theta_rad,valid"],
        "imu": ["t_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"],
        "ranges" if args.coarse else "detections": ["t_ns,landmark,range_m,bearing_rad"] if args.coarse else [
            "t_ns,camera,tag,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_y_px,hamming,decision_margin"]}
    command, next_image_s, ticks = (0.0, 0.0), 0.1, 0
    while not (teacher.done or ticks * TICK_S > 110 * args.laps):
        ticks += 1
        now = ticks * TICK_S
        teacher.speed_m_s = args.speeds[int(now / SPEED_FOR_S) % len(args.speeds)]
        plant.advance(*command, TICK_S, Disturbance(grip=bursts.grip(TICK_S)))
        motion = plant.motion()
        sensing.encoder_stuck = any(start <= now < start + lasts for start, lasts in args.encoder_stuck)
        sensing.advance(motion, TICK_S)
        if ticks % 2 == 0 and not any(start <= now < start + lasts for start, lasts in args.imu_gap):
            imu = sensing.imu(motion)
            tables["imu"].append(row(now, *imu["angular_velocity_rad_s"], *imu["linear_acceleration_m_s2"]))
        if ticks % 4 == 0:
            tables["odometry"].append(row(now, *sensing.odometry(motion, 4 * TICK_S).values()))
            tables["truth"].append(row(now, motion.x_m, motion.y_m, frames.wrap(motion.yaw_rad), 1))
            command = teacher.command(motion.x_m, motion.y_m, motion.yaw_rad, motion.yaw_rate_rad_s, 4 * TICK_S)
        if now >= next_image_s:
            next_image_s += 1 / args.image_rate_hz
            seen = looking.look(frames.inverse(base_pose(motion) @ camera.base_T_camera()))
            if args.coarse:
                tables["ranges"] += ranges(motion, [tag for tag in tags if f"tag36h11:{tag.number}" in {s["tag"] for s in seen}], now, coarse)
            else:
                stamp = stamps.of(now)
                tables["detections"] += [row(stamp, "cam", carries.get(tag["tag"], tag["tag"]), *np.ravel(tag["corners_px"]), 0, 60) for tag in seen]
    return tables


def base_pose(motion: Motion) -> np.ndarray:
    return frames.on_floor(motion.x_m, motion.y_m, motion.yaw_rad)


def ranges(motion: Motion, tags: list[course.Tag], now_s: float, rng: np.random.Generator) -> list[str]:
    """Range and bearing of tags from the base, with noise of 12 cm + 3 % and 4 degrees."""
    lines = []
    for tag in tags:
        dx, dy = tag.x_m - motion.x_m, tag.y_m - motion.y_m
        away, bearing = math.hypot(dx, dy), frames.wrap(math.atan2(dy, dx) - motion.yaw_rad)
        lines.append(row(now_s, tag.number, away + (0.12 + 0.03 * away) * rng.standard_normal(), bearing + 0.07 * rng.standard_normal()))
    return lines


def row(time_s: float, *values: object) -> str:
    cells = (f"{value:.6f}" if isinstance(value, float) else str(value) for value in values)
    return ",".join([str(round((START_S + time_s) * 1e9)), *cells])


def map_yaml(args: argparse.Namespace) -> str:
    """The tags of the map with the covariance of their errors: 21 numbers of translation and rotation in the axes of the map."""
    rng = np.random.default_rng([args.seed, 9])
    off = {int(number): (metres, 0.0) for number, metres in args.tag_off}
    count, metres = int(args.moved[0]), args.moved[1]
    step_rad = 0.0 if args.moved_alike else 2.4
    off |= {2 + place * course.TAGS // count: (metres * math.cos(step_rad * place), metres * math.sin(step_rad * place)) for place in range(count)}
    lines = ["format: waymark-map-1", f'anchor: "tag36h11:{course.ANCHOR}"', "tags:"]
    second = {number for number, _ in args.second}
    for tag in course.tags():
        if tag.number in second:
            continue
        world_T_tag = tag.world_T_tag()
        move = args.map_sigma_m * rng.standard_normal(3) + [*off.get(tag.number, (0.0, 0.0)), 0]
        turn = args.map_sigma_rad * rng.standard_normal(3)
        assumed = frames.rigid(frames.roll_pitch_yaw(*turn) @ world_T_tag[:3, :3], world_T_tag[:3, 3] + move)
        lines += [f'  - tag: "tag36h11:{tag.number}"', f"    size_m: {tag.size_m}", f"    position_m: {assumed[:3, 3].tolist()}",
                  f"    quaternion_xyzw: {quaternion(assumed[:3, :3])}"]
        if not args.no_covariance:
            # The tangent rotates about the origin of the map, so a rotation of the tag also moves it by its lever arm.
            lever = np.array([[0, -assumed[2, 3], assumed[1, 3]], [assumed[2, 3], 0, -assumed[0, 3]], [-assumed[1, 3], assumed[0, 3], 0]])
            P = np.zeros((6, 6))
            P[3:, 3:] = args.map_sigma_rad ** 2 * np.eye(3)
            P[:3, :3] = args.map_sigma_m ** 2 * np.eye(3) + lever @ P[3:, 3:] @ lever.T
            P[:3, 3:] = lever @ P[3:, 3:]
            P[3:, :3] = P[:3, 3:].T
            lines.append(f"    covariance: {[float(P[i, j]) for i in range(6) for j in range(i, 6)]}")
    return "\n".join(lines) + "\n"


def quaternion(matrix: np.ndarray) -> list[float]:
    """x, y, z, w."""
    values, vectors = np.linalg.eigh(np.array([
        [matrix[0, 0] - matrix[1, 1] - matrix[2, 2], matrix[0, 1] + matrix[1, 0], matrix[0, 2] + matrix[2, 0], matrix[2, 1] - matrix[1, 2]],
        [0, matrix[1, 1] - matrix[0, 0] - matrix[2, 2], matrix[1, 2] + matrix[2, 1], matrix[0, 2] - matrix[2, 0]],
        [0, 0, matrix[2, 2] - matrix[0, 0] - matrix[1, 1], matrix[1, 0] - matrix[0, 1]],
        [0, 0, 0, np.trace(matrix)]]), UPLO="U")
    return [float(value) for value in vectors[:, int(np.argmax(values))]]


def landmarks_csv() -> str:
    return "\n".join(["id,x,y", *(f"{tag.number},{tag.x_m:.4f},{tag.y_m:.4f}" for tag in course.tags())]) + "\n"


def main() -> None:
    args = arguments()
    if args.one_sided:
        course.use_oval()
    args.folder.mkdir(parents=True, exist_ok=True)
    for name, lines in drive(args).items():
        if name == "imu" and args.no_imu:
            continue
        (args.folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    (args.folder / "map.yaml").write_text(map_yaml(args))
    (args.folder / "robot.yaml").write_text(body.robot_yaml(body.Camera()))
    if args.coarse:
        (args.folder / "landmarks.csv").write_text(landmarks_csv())


if __name__ == "__main__":
    main()
