#!/usr/bin/python3
"""The plant behind each protocol: `waymark robot-sim --plant` combines independent physics and sensors with a LIMO on a serial port, a robot
on ROS 2, an MBot on LCM and a robot in Gazebo. A lap is taught, mapped and replayed over each and compared with the ground truth of the plant;
blocked wheels and an unplugged camera must stop it as in one process.

    WAYMARK_FULL=1 tests/plant/wires_test.py build/check/bin/waymark [Wires.test_limo]

WAYMARK_PLANT: mujoco or kinematic.
"""
import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent), str(pathlib.Path(__file__).resolve().parents[1] / "support")]
import course
import fault_script
import faults
import judge
import waymark_runs
from claim import domain, lcm_port
from lap_test import Lap, last_words

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
PLANT = os.environ.get("WAYMARK_PLANT", "mujoco")
LONG = unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "longer: WAYMARK_FULL=1")
SPEED_M_S = 0.25
FAULT_AT_S = 20  # since the plant was switched on
# Cross-track error of a replay with the plant in one process, times 1.2.
MOST_RMSE_CM, MOST_CM = 1.2 * 1.0, 1.2 * 2.5


class Wires(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.place = waymark_runs.Place(PROGRAM, pathlib.Path(folder.name))
        (self.place.folder / "world.yaml").write_text(course.world_yaml())
        self.environment = dict(os.environ)

    def simulator(self, wire: list[str], options: list[str], truth: str) -> list[str]:
        plant = waymark_runs.process(options, self.place.folder / truth)
        return [PROGRAM, "robot-sim", *wire, "--plant", plant, "--world", "world.yaml", "--robot-file", "robot.yaml"]

    @contextlib.contextmanager
    def simulated(self, wire: list[str], options: list[str], truth: str):
        """Starts the simulator; its first line is the port, if the protocol has one."""
        sim = subprocess.Popen(self.simulator(wire, options, truth), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               cwd=self.place.folder, env=self.environment)
        try:
            yield sim.stdout.readline().strip() if "--limo" in wire else ""
            sim.send_signal(signal.SIGINT)
            _, output = sim.communicate(timeout=30)
            self.assertEqual(sim.returncode, 0, output)
        finally:
            sim.kill()
            sim.communicate()

    def lap(self, wire: list[str], robot, camera: str = "corners", anchor: str = str(course.ANCHOR)) -> Lap:
        """`robot` returns the value of --robot for a port."""
        options, lap = ["--plant", PLANT, "--camera", camera], Lap()
        teach = ["--teach", "0.3", "--teach-after", str(self.place.folder / "lap.go"), "--seed", "1"]
        with self.simulated(wire, options + teach, "lap.csv") as port:
            taught = self.place.teach_robot(robot(port), environment=self.environment, anchor=anchor)
            self.assertEqual(taught.code, 0, taught.err)
        mapped = self.place.map()
        self.assertEqual(mapped.code, 0, mapped.err)
        lap.map_errors = judge.tag_errors(judge.read_map(self.place.folder / "map" / "map.yaml"), course.tags(), anchored=False)
        run, driven = self.replay(wire, robot, options + ["--seed", "2"], "replay.csv")
        lap.replay_errors = judge.tracking(judge.read_truth(self.place.folder / "lap.csv"), driven)
        lap.finished, lap.words = run.code == 0 and bool(run.report.get("finished")), last_words(run)
        self.assertTrue(lap.finished, f"{lap.words}\n{run.err}")
        for kind in ("blocked", "camera_unplugged"):
            self.stops(wire, robot, options, kind)
        return lap

    def replay(self, wire: list[str], robot, options: list[str], truth: str):
        with self.simulated(wire, options, truth) as port:
            words = ["replay", "map", "--robot", robot(port), "--speed-m-s", str(SPEED_M_S), "--json"]
            run = self.place.waymark(*words, environment=self.environment)
        return run, judge.read_truth(self.place.folder / truth)

    def stops(self, wire: list[str], robot, options: list[str], kind: str):
        """The law of faults.py, over each protocol."""
        fault = f"{kind}@{FAULT_AT_S}"
        run, driven = self.replay(wire, robot, [*options, "--seed", "3", "--fault", fault], f"{kind}.csv")
        found = faults.judge_run(judge.read_truth(self.place.folder / "lap.csv"), driven, fault_script.parse(fault), last_words(run), fault)
        print(f"  {fault}: zero after {found.zero_after_s} s, {found.travel_m} m, {found.words}", flush=True)
        self.assertTrue(found.right, found)
        self.assertEqual(run.code, 1, run.err)

    def judge(self, wire: str, lap: Lap):
        rmse_cm, most_cm = 100 * lap.replay_errors.rmse_m, 100 * lap.replay_errors.max_m
        print(f"{PLANT} behind {wire}: tags RMSE {100 * lap.map_errors.rmse_m:.2f} cm; replay RMSE {rmse_cm:.2f} cm, max {most_cm:.2f} cm")
        self.assertLess(rmse_cm, MOST_RMSE_CM)
        self.assertLess(most_cm, MOST_CM)

    @LONG
    def test_limo(self):
        pipe = self.place.folder / "beside"
        self.judge("LIMO's serial port", self.lap(["--limo", "--beside", str(pipe)],
                                                  lambda port: f"process:exec '{PROGRAM}' limo robot {port} --beside {pipe} --simulated"))

    @LONG
    def test_ros2(self):
        self.environment.update(ROS_DOMAIN_ID=str(domain()), ROS_LOCALHOST_ONLY="1")
        self.judge("ROS 2", self.lap(["--ros2", "--localhost"], lambda _: "ros2:limo-sim-tags"))

    @LONG
    def test_mbot(self):
        url = f"udpm://239.255.76.67:{lcm_port()}?ttl=0"
        self.judge("MBot's LCM", self.lap(["--mbot", url], lambda _: "mbot:" + url, anchor="tagCustom48h12:0"))

    @LONG
    def test_gazebo(self):
        self.environment.update(IGN_IP="127.0.0.1", IGN_PARTITION=f"waymark-plant-{os.getpid()}")
        self.judge("Gazebo's topics", self.lap(["--gazebo", "limo"], lambda _: "gazebo:limo", camera="images"))

    def refused(self, command: list[str], code: int) -> str:
        done = subprocess.run(command, cwd=self.place.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def test_a_plant_without_images_is_refused_for_gazebo(self):
        output = self.refused(self.simulator(["--gazebo", "limo"], [], "t.csv"), 1)
        self.assertIn("(odometry, wheels, detections, imu)", output)

    def test_the_simulator_fails_when_its_plant_ends(self):
        output = self.refused(self.simulator(["--limo"], ["--limit-s", "0.2"], "t.csv"), 1)
        self.assertIn("ended", output)

    def test_a_plant_without_a_protocol_or_with_options_of_the_simulator_is_refused(self):
        self.assertIn("--plant", self.refused(self.simulator([], [], "t.csv"), 2))
        self.assertIn("--images", self.refused(self.simulator(["--limo", "--images"], [], "t.csv"), 2))
        words = [PROGRAM, "robot-sim", "--limo", "--world", "world.yaml", "--plant", "robot.py"]
        self.assertIn("process:CMD", self.refused(words, 2))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]], verbosity=2)
