"""The robot of the exercise: a simulator whose time advances when a sensor is read again."""

import dataclasses
import functools
import inspect
import math
import threading
import types

from .score import ScoredImage

TAG_FILE = "/resources/exercises/marker_visual_loc/apriltags_poses.yaml"
HALF_BOARD_M = 0.01  # the boards of the world academy-house are 20 mm thick, with the tags on their faces
POSE = "a sequence (x, y, yaw) in metres and radians"


class Finished(BaseException):
    """The time for the exercise is over. Not derived from Exception, so that a student's `except Exception` does not catch it."""


@dataclasses.dataclass
class Pose3d:
    """Return value of HAL.getOdom(), in metres and radians."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    z: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    timeStamp: float = 0.0


@dataclasses.dataclass
class LaserData:
    """Return value of HAL.getLaserData(), in metres; infinite if nothing is in range."""

    values: list = dataclasses.field(default_factory=list)
    minAngle: float = 0.0
    maxAngle: float = 0.0
    minRange: float = 0.0
    maxRange: float = 0.0
    timeStamp: float = 0.0


class Robot:
    """Answers calls of HAL from the latest samples. Repeating a call that was answered since the last image advances time. Shown estimates
    go to the journal; `passed(finished)` is called after each advance of time. All methods are thread-safe."""

    def __init__(self, journal, passed, seconds, seed, camera_rate_hz):
        from .. import config, simulation

        self._journal, self._passed = journal, passed
        self.world = config.read_world("academy-house")
        description = config.read_robot("turtlebot3-waffle")
        self._camera = description.camera
        self._simulator = simulation.Simulator(self.world, description, seed=seed, images=True, camera_rate_hz=camera_rate_hz)
        self._seconds, self._rate_hz = seconds, camera_rate_hz
        self.finished = False
        self._lock = threading.RLock()
        self._asked = set()
        self._ticked_s = None  # the last Frequency.tick()
        self._command = (0.0, 0.0)
        self._image = self._odometry = None
        self._laser = None
        self._pass()

    @property
    def now_s(self):
        """Simulated time since the start [s]."""
        return self._simulator.now_ns * 1e-9

    def _pass(self):
        """Advances time to the next image; the wheels keep the latest command, as with the robot's driver."""
        from .. import samples

        self._asked.clear()
        frame = None
        while frame is None:
            if self._image is not None and self.now_s >= self._seconds:
                self._finish()
                raise Finished
            self._simulator.command(*self._command)
            sample = self._simulator.next()
            if isinstance(sample, samples.CameraFrame):
                frame = sample if self._odometry is not None and self._laser is not None else None  # the first one waits for all sensors
            elif isinstance(sample, samples.Odometry):
                at = sample.odom_T_base
                self._odometry = Pose3d(at.x, at.y, at.yaw, timeStamp=sample.stamp_ns * 1e-9)
            elif isinstance(sample, samples.LaserScan):
                last = sample.angle_min_rad + sample.angle_increment_rad * (len(sample.ranges_m) - 1)
                self._laser = LaserData([float(r) for r in sample.ranges_m], sample.angle_min_rad, last, sample.range_min_m,
                                        sample.range_max_m, sample.stamp_ns * 1e-9)
        self._image = frame.image
        self._journal.image(ScoredImage(self.now_s, self._truth(), left=max(0, int((self._seconds - self.now_s) * self._rate_hz))))
        self._passed(False)

    def _finish(self):
        """Stops the robot."""
        if not self.finished:
            self._simulator.command(0.0, 0.0)
            self._journal.change(finished=True, left=0)
            self._passed(True)
        self.finished = True

    def _truth(self):
        at = self._simulator.true_map_T_base
        return at.x, at.y, at.yaw

    def _ask(self, what):
        if what in self._asked:
            self._pass()
        self._asked.add(what)

    def getImage(self):
        """The latest image, an array (height, width, 3) of uint8: blue, green, red. The simulated camera is grey."""
        import numpy

        with self._lock:
            self._ask("image")
            return numpy.repeat(self._image[:, :, None], 3, axis=2)

    def getOdom(self):
        """The latest odometry: x, y [m], yaw [rad, positive to the left] and timeStamp [s], relative to the start pose of the robot; it drifts."""
        with self._lock:
            self._ask("odometry")
            return dataclasses.replace(self._odometry)

    def getLaserData(self):
        """The latest scan: values (the ranges [m], in equal angular steps from minAngle to maxAngle [rad]) and timeStamp [s]. Angle 0 is straight
        ahead, and positive angles are to the left. A range is infinite if nothing is between minRange and maxRange [m]."""
        with self._lock:
            self._ask("laser")
            return dataclasses.replace(self._laser, values=list(self._laser.values))

    def setV(self, speed_m_s):
        """Sets the forward speed [m/s], within the limits of the robot."""
        self._command = (_number(speed_m_s, "HAL.setV"), self._command[1])

    def setW(self, yaw_rate_rad_s):
        """Sets the yaw rate [rad/s], positive to the left, within the limits of the robot."""
        self._command = (self._command[0], _number(yaw_rate_rad_s, "HAL.setW"))

    def showEstimatedPose(self, pose):
        """Shows the estimated pose: one argument, (x, y, yaw) in metres and radians in the map, the frame of the tag poses. It is scored."""
        values = _pose(pose)
        with self._lock:
            if all(map(math.isfinite, values)):
                self._journal.change(estimate=values, truth_of_estimate=self._truth())
            else:
                self._journal.not_finite()

    def showImage(self, image):
        """Accepts an image for the exercise page, as returned by HAL.getImage(). It is not displayed here."""
        if len(getattr(image, "shape", ())) not in (2, 3):
            raise TypeError(f"WebGUI.showImage was given {_shown(image)}: expected an image, as returned by HAL.getImage()")

    def sleep(self, seconds):
        """Advances simulated time by at least this duration."""
        length_s = _number(seconds, "time.sleep")
        if length_s < 0:
            raise ValueError("sleep length must be non-negative")
        with self._lock:
            end = self.now_s + length_s
            while self.now_s < end:
                self._pass()

    def tick(self, ideal_rate=50.0):
        """Paces a loop: advances simulated time until 1 / ideal_rate [s] after the last call was due, if that is in the future."""
        rate_hz = _number(ideal_rate, "Frequency.tick")
        if rate_hz <= 0:
            raise ValueError(f"Frequency.tick was given {rate_hz}: expected a rate above 0")
        with self._lock:
            due_s = self.now_s if self._ticked_s is None else self._ticked_s + 1 / rate_hz
            while self.now_s < due_s:
                self._pass()
            late = self.now_s - due_s > 1 / rate_hz  # a slow loop does not catch up
            self._ticked_s = self.now_s if late else due_s

    def tags_yaml(self):
        """The file for the exercise: x, y, z [m] of the centre of each tag's board, and the heading [rad] of a robot
        facing the tag, measured from map x."""
        lines = ["tags:"]
        for name in self.world.tags:
            at = self.world.tags[name].map_T_tag
            into = at.rotation @ [0.0, 0.0, 1.0]
            yaw = math.atan2(into[1], into[0])
            x, y, z = at.translation + HALF_BOARD_M * into
            lines += [f"  tag_{name.split(':')[1]}:", f"    position: [{x:.6f}, {y:.6f}, {z:.6f}, {yaw:.6f}]"]
        return "\n".join(lines) + "\n"

    def modules(self):
        """The modules HAL, WebGUI and Frequency of the exercise."""
        hal = self._module("HAL", "The robot of the exercise: its sensors and motors. Time advances when a sensor is read again.",
                           (self.getImage, self.getOdom, self.getLaserData, self.setV, self.setW))
        gui = self._module("WebGUI", "The page of the exercise, which shows the results of the solution.", (self.showEstimatedPose, self.showImage))
        frequency = self._module("Frequency", "Paces a loop.", (self.tick,))
        return {"HAL": hal, "WebGUI": gui, "GUI": gui, "Frequency": frequency}

    def _module(self, name, about, methods):
        module = types.ModuleType(name, about)
        module.__all__ = [method.__name__ for method in methods]  # help() shows these
        for method in methods:
            setattr(module, method.__name__, self._call(name, method))
        return module

    def _call(self, module, method):
        """Wraps the method as a module function. The journal counts refused calls."""
        signature, name = inspect.signature(method), f"{module}.{method.__name__}"

        @functools.wraps(method)
        def call(*arguments, **named):
            try:
                _fits(signature, name, arguments, named)
                return method(*arguments, **named)
            except (TypeError, ValueError) as failure:
                with self._lock:
                    self._journal.refused(str(failure))
                raise

        call.__module__, call.__qualname__ = module, method.__name__
        return call


def _shown(value):
    text = repr(value)
    return f"{text if len(text) <= 40 else text[:37] + '...'} (a {type(value).__name__})"


def _fits(signature, call, arguments, named):
    try:
        signature.bind(*arguments, **named)
    except TypeError:
        needed = f"expected {call}{signature}" + (f", pose is {POSE}" if call == "WebGUI.showEstimatedPose" else "")
        count, names = len(arguments) + len(named), f" ({', '.join(named)})" if named else ""
        raise TypeError(f"{call} was given {count} argument{'' if count == 1 else 's'}{names}: {needed}") from None


def _number(value, call):
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{call} was given {_shown(value)}: expected a number") from None
    if not math.isfinite(number):
        raise ValueError(f"{call} was given {number}: expected a finite number")
    return number


def _pose(pose):
    """(x, y, yaw) from a tuple, list or array of three numbers, or from an object with these attributes."""
    try:
        values = tuple(map(float, (pose.x, pose.y, pose.yaw) if hasattr(pose, "yaw") else () if isinstance(pose, str) else pose))
    except (TypeError, ValueError, OverflowError, AttributeError):
        values = ()
    if len(values) != 3:
        raise ValueError(f"WebGUI.showEstimatedPose was given {_shown(pose)}: expected one argument, {POSE}")
    return values
