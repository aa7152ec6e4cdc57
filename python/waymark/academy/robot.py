"""The robot of the exercise: a simulator whose time passes when its sensors are asked again."""

import dataclasses
import math
import types

TAG_FILE = "/resources/exercises/marker_visual_loc/apriltags_poses.yaml"


class Finished(BaseException):
    """The time of the exercise is over. No Exception, so that a student's `except Exception` lets it pass."""


@dataclasses.dataclass
class Pose3d:
    """What HAL.getOdom() gives: metres and radians."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    z: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    timeStamp: float = 0.0


@dataclasses.dataclass
class LaserData:
    """What HAL.getLaserData() gives: metres; infinite where nothing is in range."""

    values: list = dataclasses.field(default_factory=list)
    minAngle: float = 0.0
    maxAngle: float = 0.0
    minRange: float = 0.0
    maxRange: float = 0.0
    timeStamp: float = 0.0


class Stalled(BaseException):
    """The solution asked no sensor for too long in real time. No Exception, as Finished."""


class Robot:
    """Answers the calls of HAL from the newest samples; a call that was answered since the last picture lets the time pass."""

    def __init__(self, score, seconds=60.0, seed=1, camera_rate_hz=10.0):
        from .. import config, simulation

        self.score = score
        self.world = config.read_world("academy-house")
        description = config.read_robot("turtlebot3-waffle")
        self._camera = description.camera
        self._simulator = simulation.Simulator(self.world, description, seed=seed, pictures=True, camera_rate_hz=camera_rate_hz)
        self._seconds, self._rate_hz = seconds, camera_rate_hz
        self.passes = 0  # how often time has passed: who waits for a solution sees by it that it goes on
        self.finished = False
        self._asked = set()
        self._command = (0.0, 0.0)
        self._image = self._odometry = None
        self._laser = None
        self._pass()

    @property
    def now_s(self):
        return self._simulator.now_ns * 1e-9

    def _pass(self):
        """Lets the time pass until the next picture; the wheels keep the newest command, as the robot's driver does."""
        from .. import samples

        self._asked.clear()
        picture = None
        while picture is None:
            if self.now_s >= self._seconds:
                self.finished = True
                raise Finished
            self._simulator.command(*self._command)
            sample = self._simulator.next()
            if isinstance(sample, samples.CameraFrame):
                picture = sample if self._odometry is not None and self._laser is not None else None  # the first waits for all sensors
            elif isinstance(sample, samples.Odometry):
                at = sample.odom_T_base
                self._odometry = Pose3d(at.x, at.y, at.yaw, timeStamp=sample.stamp_ns * 1e-9)
            elif isinstance(sample, samples.LaserScan):
                last = sample.angle_min_rad + sample.angle_increment_rad * (len(sample.ranges_m) - 1)
                self._laser = LaserData([float(r) for r in sample.ranges_m], sample.angle_min_rad, last, sample.range_min_m,
                                        sample.range_max_m, sample.stamp_ns * 1e-9)
        self._image = picture.image
        truth = self._simulator.true_map_T_base
        self.score.picture(self.now_s, (truth.x, truth.y, truth.yaw))
        self.passes += 1

    def stop(self):
        """The robot stands from now on."""
        self._command = (0.0, 0.0)
        self._simulator.command(0.0, 0.0)

    @property
    def pictures_left(self):
        """How many pictures the time that is left would bring."""
        return max(0, int((self._seconds - self.now_s) * self._rate_hz))

    def _ask(self, what):
        if what in self._asked:
            self._pass()
        self._asked.add(what)

    def getImage(self):
        """The newest picture, (height, width, 3) uint8, blue, green, red; the simulated camera is grey."""
        import numpy

        self._ask("image")
        return numpy.repeat(self._image[:, :, None], 3, axis=2)

    def getOdom(self):
        self._ask("odometry")
        return dataclasses.replace(self._odometry)

    def getLaserData(self):
        self._ask("laser")
        return dataclasses.replace(self._laser)

    def setV(self, speed_m_s):
        self._command = (_number(speed_m_s, "HAL.setV"), self._command[1])

    def setW(self, yaw_rate_rad_s):
        self._command = (self._command[0], _number(yaw_rate_rad_s, "HAL.setW"))

    def showEstimatedPose(self, pose):
        """(x, y, yaw) in metres and radians in the map."""
        values = [pose.x, pose.y, pose.yaw] if hasattr(pose, "yaw") else list(pose)
        if len(values) != 3:
            raise ValueError(f"WebGUI.showEstimatedPose takes (x, y, yaw): {len(values)} numbers were given")
        truth = self._simulator.true_map_T_base
        self.score.estimate(self.now_s, tuple(float(v) for v in values), (truth.x, truth.y, truth.yaw))

    def sleep(self, seconds):
        """Simulated time passes by at least so long."""
        end = self.now_s + _number(seconds, "time.sleep")
        while self.now_s < end:
            self._pass()

    def tags_yaml(self):
        """The file of the exercise: x, y, z [m] and the direction [rad] from each tag to its reader, counted from map x."""
        lines = ["tags:"]
        for name in self.world.tags:
            at = self.world.tags[name].map_T_tag
            towards = at.rotation @ [0.0, 0.0, -1.0]
            yaw = math.atan2(towards[1], towards[0])
            x, y, z = at.translation
            lines += [f"  tag_{name.split(':')[1]}:", f"    position: [{x:.6f}, {y:.6f}, {z:.6f}, {yaw:.6f}]"]
        return "\n".join(lines) + "\n"

    def modules(self):
        """The modules HAL and WebGUI of the exercise; HAL.getPose3d() gives odometry too, as there is no truth to be had."""
        hal, gui = types.ModuleType("HAL"), types.ModuleType("WebGUI")
        for name in ("getImage", "getOdom", "getLaserData", "setV", "setW"):
            setattr(hal, name, getattr(self, name))
        gui.showEstimatedPose = self.showEstimatedPose
        gui.showImage = self.score.show_image
        return {"HAL": hal, "WebGUI": gui, "GUI": gui}


def _number(value, call):
    try:
        number = float(value)
    except (TypeError, ValueError):
        shown = repr(value)
        raise TypeError(f"{call} was given {shown if len(shown) <= 40 else shown[:37] + '...'} (a {type(value).__name__}): a number is needed") from None
    if not math.isfinite(number):
        raise ValueError(f"{call} was given {number}: a finite number is needed")
    return number
