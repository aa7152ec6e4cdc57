#!/usr/bin/python3
"""A robot that shares no code with Waymark's simulator: for `waymark teach|replay --robot "process:tests/plant/robot.py ..."`.

Implements the protocol of docs/formats/robot-process.md in lockstep. With --teach it drives a lap by itself and ignores received commands;
with --send-commands it also sends its own commands, so that they are recorded. Its true pose is written to --truth (CSV), and sent only with
--send-truth."""
import argparse
import collections
import json
import math
import os
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import body
import corner_camera
import course
import fault_script
import frames
import kinematic_plant
import sensors
import wrong_wiring
from drive import Disturbance, DriveOptions, Motion, Plant
from messages import Line
from teacher import Teacher

TICK_S = 0.005
TICKS_ODOMETRY, TICKS_IMU = 4, 2
CAMERA_HZ = 15.0
TRUTH_HEADER = "t_s,x_m,y_m,yaw_rad,speed_command_m_s,yaw_rate_command_rad_s\n"


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plant", choices=["kinematic", "mujoco"], default="kinematic")
    parser.add_argument("--camera", choices=["corners", "images"], default="corners")
    parser.add_argument("--odometry", choices=["gyro", "wheels"], default="gyro", help="what the driver takes turning from")
    parser.add_argument("--no-imu", action="store_true", help="send no imu lines")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--turn-gain", type=float, default=0.6, help="kinematic plant: share of the asked yaw rate that it turns")
    parser.add_argument("--sag", type=float, default=0.10, help="share of speed lost as the battery empties")
    parser.add_argument("--gain-step", metavar="FACTOR@T_S", help="kinematic plant: multiply the yaw gain by FACTOR from then on")
    parser.add_argument("--latency-s", type=float, default=0.05, help="images come so long after their exposure")
    parser.add_argument("--late-stamps-s", type=float, default=0.0, help="images are stamped so long after their exposure")
    parser.add_argument("--tags", type=int, default=course.TAGS, metavar="COUNT", help="number of tags on the course, from 3 to 24")
    parser.add_argument("--line", type=pathlib.Path, metavar="FILE", help="the course is a recorded line (s, x, y, theta, curvature) with tags around")
    parser.add_argument("--lean-deg", type=float, default=0.0, help="how far the anchor leans back")
    parser.add_argument("--mounting", type=float, nargs=6, default=[0.0] * 6, metavar=("X", "Y", "Z", "ROLL", "PITCH", "YAW"),
                        help="true camera minus that of the robot file [m, deg]")
    parser.add_argument("--focal-scale", type=float, default=1.0, help="true focal length over that of the robot file")
    parser.add_argument("--start", type=float, nargs=3, default=[0.0] * 3, metavar=("AHEAD_M", "LEFT_M", "TURN_DEG"),
                        help="start pose relative to the beginning of the lap")
    parser.add_argument("--fault", type=fault_script.parse, action="append", default=[], help="KIND@START[:DURATION], may be repeated: "
                        + "; ".join(f"{kind}: {what}" for kind, what in fault_script.KINDS.items()))
    parser.add_argument("--wrong", choices=sorted(wrong_wiring.NAMED), help="a sign, an axis or a unit is swapped")
    parser.add_argument("--teach", type=float, metavar="M_S", help="drive the lap at this speed, whatever is commanded")
    parser.add_argument("--teach-after", type=pathlib.Path, metavar="FILE", help="wait until this file exists")
    parser.add_argument("--send-commands", action="store_true", help="with --teach: also send command lines, what the teacher decided")
    parser.add_argument("--send-truth", action="store_true", help="also send truth lines, which a scripted driver of Waymark's needs")
    parser.add_argument("--truth", type=pathlib.Path, help="CSV of the true poses and the commands; FILE.done appears when a taught lap is over")
    parser.add_argument("--limit-s", type=float, default=300.0, help="end after this time of the plant")
    return parser.parse_args()


class Robot:
    def __init__(self, args: argparse.Namespace):
        self.args = args
        if args.line:
            course.use_recorded(args.line)
        self.faults: list[fault_script.Fault] = args.fault
        self.ticks = 0
        self.plant = make_plant(args)
        self.sensors = sensors.Sensors(sensors.SensorOptions(odometry=args.odometry), args.seed)
        self.camera_model = true_camera(args)
        self.base_T_camera = self.camera_model.base_T_camera()
        self.tags = course.tags(math.radians(args.lean_deg), args.tags)
        self.camera = make_camera(args, self.camera_model, self.tags)
        self.teacher = Teacher(args.teach, args.seed) if args.teach else None
        self.command = (0.0, 0.0)
        self.history: collections.deque[tuple[float, Motion]] = collections.deque(maxlen=200)
        self.images: collections.deque[tuple[float, float]] = collections.deque()  # time of arrival, middle of the exposure
        self.next_image_s = 0.1
        self.frozen: list[Motion] | None = None
        self.truth = open(args.truth, "w") if args.truth else None
        if self.truth:
            self.truth.write(TRUTH_HEADER)

    @property
    def time_s(self) -> float:
        return self.ticks * TICK_S

    def active(self, kind: str) -> bool:
        return any(fault.kind == kind and fault.active(self.time_s) for fault in self.faults)

    def send(self, kind: str, stamp_s: float, **values: object) -> None:
        jump = 0.5 if self.active("clock_jump") else 0.0
        values = wrong_wiring.sent(self.args.wrong, kind, values)
        sys.stdout.write(json.dumps({"type": kind, "stamp_ns": round((stamp_s + jump + 100.0) * 1e9), **values}) + "\n")

    def tick(self) -> None:
        self.ticks += 1
        disturbance = Disturbance(held=self.active("held"), blocked=self.active("blocked"),
                                  grip=0.08 if self.active("spinning") else 1.0, gain_factor=0.7 if self.active("gain_step") else 1.0)
        self.plant.advance(*self.command, TICK_S, disturbance)
        motion = self.plant.motion()
        self.sensors.encoder_stuck, self.sensors.gyro_stuck = self.active("encoder_stuck"), self.active("gyro_stuck")
        self.sensors.advance(motion, TICK_S)
        x, y = fault_script.carried(self.faults, self.time_s)
        motion.x_m, motion.y_m = motion.x_m + x, motion.y_m + y
        self.history.append((self.time_s, motion))
        if self.ticks % TICKS_IMU == 0 and not self.args.no_imu:
            self.send("imu", self.time_s, **self.sensors.imu(motion))
        if self.ticks % TICKS_ODOMETRY == 0:
            left, right = self.sensors.wheels(motion)
            self.send("wheels", self.time_s, left_rad=left, right_rad=right)
            self.send("odometry", self.time_s, **self.sensors.odometry(motion, TICKS_ODOMETRY * TICK_S))
            if self.args.send_truth:
                self.send("truth", self.time_s, x_m=motion.x_m, y_m=motion.y_m, yaw_rad=frames.wrap(motion.yaw_rad))
            if self.truth:
                self.truth.write(f"{self.time_s:.3f},{motion.x_m:.6f},{motion.y_m:.6f},{motion.yaw_rad:.6f},"
                                 f"{self.command[0]:.4f},{self.command[1]:.4f}\n")
        self.look()

    def look(self) -> None:
        """Takes an image at its time, and sends it after its latency."""
        if self.time_s >= self.next_image_s:
            late = self.args.latency_s + (0.3 if self.active("latency") else 0.0)
            self.images.append((self.time_s + late, self.time_s))
            self.next_image_s += 1 / CAMERA_HZ
        while self.images and self.images[0][0] <= self.time_s:
            _, exposed_s = self.images.popleft()
            if self.active("camera_unplugged"):
                continue
            stamp_s = exposed_s + self.args.late_stamps_s + (0.3 if self.active("latency") else 0.0)
            if self.active("stuck_feed"):
                self.frozen = self.frozen or self.around(exposed_s)
            else:
                self.frozen = None
            motions = self.frozen or self.around(exposed_s)
            line = self.camera.message(motions, stamp_s, self.active("dark"))
            self.send(line.kind, line.stamp_s, **line.values)

    def around(self, time_s: float) -> list[Motion]:
        """The motions of the ticks during the exposure and readout of an image."""
        return [motion for at, motion in self.history if abs(at - time_s) < self.camera.half_window_s + 1e-6]

    def decide(self, ordered: tuple[float, float]) -> None:
        if not self.teacher:
            self.command = wrong_wiring.obeyed(self.args.wrong, ordered)
            return
        self.command = self.taught() if not self.args.teach_after or self.args.teach_after.exists() else (0.0, 0.0)
        if self.args.send_commands:
            self.send("command", self.time_s, speed_m_s=self.command[0], yaw_rate_rad_s=self.command[1])

    def taught(self) -> tuple[float, float]:
        """The current command of the teacher."""
        motion = self.history[-1][1]
        command = self.teacher.command(motion.x_m, motion.y_m, motion.yaw_rad, motion.yaw_rate_rad_s, TICKS_ODOMETRY * TICK_S)
        if self.teacher.done and self.args.truth:
            self.args.truth.with_suffix(".done").touch()
        return command


class CornerSource:
    """The corner camera as the robot uses it: one moment, one message."""
    half_window_s = 0.0

    def __init__(self, camera: corner_camera.CornerCamera, base_T_camera):
        self._camera, self._base_T_camera = camera, base_T_camera

    def message(self, motions: list[Motion], stamp_s: float, dark: bool) -> Line:
        world_T_camera = world_T_base(motions[len(motions) // 2]) @ self._base_T_camera
        tags = self._camera.look(frames.inverse(world_T_camera), dark)
        return Line("detections", stamp_s, {"tags": tags})


def world_T_base(motion: Motion):
    return frames.rigid(frames.roll_pitch_yaw(motion.roll_rad, motion.pitch_rad, motion.yaw_rad), (motion.x_m, motion.y_m, motion.z_m))


def true_camera(args: argparse.Namespace) -> body.Camera:
    c, off = body.Camera(), args.mounting
    roll, pitch, yaw = (math.radians(angle) for angle in off[3:])
    return body.Camera(fx_px=c.fx_px * args.focal_scale, fy_px=c.fy_px * args.focal_scale, x_m=c.x_m + off[0], y_m=c.y_m + off[1],
                       z_m=c.z_m + off[2], roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw)


def make_plant(args: argparse.Namespace) -> Plant:
    x, y, yaw, _ = course.lap()[0]
    start = frames.compose((x, y, yaw), (args.start[0], args.start[1], math.radians(args.start[2])))
    drive = DriveOptions(sag=args.sag)
    if args.plant == "mujoco":
        import mujoco_plant
        return mujoco_plant.MujocoPlant(start, drive, args.seed)
    options = kinematic_plant.KinematicOptions(turn_gain=args.turn_gain)
    if args.gain_step:
        factor, _, at = args.gain_step.partition("@")
        options.gain_step, options.gain_step_at_s = float(factor), float(at)
    return kinematic_plant.KinematicPlant(start, drive, options, args.seed)


def make_camera(args: argparse.Namespace, model: body.Camera, tags: tuple[course.Tag, ...]):
    if args.camera == "images":
        import image_camera
        return image_camera.ImageCamera(model, tags, args.seed)
    return CornerSource(corner_camera.CornerCamera(model, tags, corner_camera.CornerOptions(), args.seed), model.base_T_camera())


def await_order(step: int) -> tuple[float, float] | None:
    """The command for this step, or None at the end of the input. Lines of the watchdog have no step and are skipped in lockstep."""
    for line in sys.stdin:
        order = json.loads(line)
        if order["type"] == "bye":
            return None
        if order["type"] == "velocity" and order.get("step") == step:
            return order["speed_m_s"], order["yaw_rate_rad_s"]
    return None


def main() -> None:
    args = arguments()
    robot = Robot(args)
    sends = ["odometry", "wheels", "image" if args.camera == "images" else "detections"] + ([] if args.no_imu else ["imu"])
    print(json.dumps({"type": "hello", "protocol_version": 1, "name": f"plant {args.plant}", "sends": sends, "lockstep": True}), flush=True)
    step = 0
    while robot.time_s < args.limit_s:
        for _ in range(TICKS_ODOMETRY):
            robot.tick()
        step += 1
        robot.send("step", robot.time_s, step=step)
        sys.stdout.flush()
        ordered = await_order(step)
        if ordered is None:
            break
        robot.decide(ordered)


try:
    main()
except BrokenPipeError:  # the reader is gone: the robot stops
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
