#!/usr/bin/python3
"""A taught lap contains the commands that drove the plant: a plant of the same seed moves identically when it receives them.

    tests/plant/teacher_test.py build/check/bin/waymark
"""
import pathlib
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import course
import judge
import kinematic_plant
import mcap_poses
from drive import Disturbance, DriveOptions
from waymark_runs import Place

PROGRAM = ""
SEED, GAIN = 5, 0.6
TICK_S, TICKS_COMMAND = 0.005, 4
CLOCK_S = 100.0  # of the robot when it is switched on


def driven_by(commands: np.ndarray, until_s: float) -> np.ndarray:
    """Rows of t, x, y, yaw of a plant that receives each command in the tick after its stamp."""
    x, y, yaw, _ = course.lap()[0]
    plant = kinematic_plant.KinematicPlant((x, y, yaw), DriveOptions(), kinematic_plant.KinematicOptions(turn_gain=GAIN), SEED)
    at_tick = {round((stamp - CLOCK_S) / TICK_S): (speed, turn) for stamp, speed, turn in commands}
    command, rows = (0.0, 0.0), []
    for tick in range(1, round(until_s / TICK_S) + 1):
        command = at_tick.get(tick - 1, command)
        plant.advance(*command, TICK_S, Disturbance())
        motion = plant.motion()
        if tick % TICKS_COMMAND == 0:
            rows.append([tick * TICK_S, motion.x_m, motion.y_m, motion.yaw_rad])
    return np.array(rows)


class RecordedCommands(unittest.TestCase):
    def test_move_the_plant_as_it_moved(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            place = Place(PROGRAM, pathlib.Path(folder))
            taught = place.teach_fast(["--plant", "kinematic", "--camera", "corners", "--turn-gain", str(GAIN), "--seed", str(SEED)])
            self.assertEqual(taught.code, 0, taught.err)
            truth = judge.read_truth(place.folder / "lap.csv")
            commands = mcap_poses.commands(place.folder / "lap.mcap")
        self.assertGreater(float(np.abs(commands[:, 2]).max()), 0.3, "the robot was commanded to turn")
        again = driven_by(commands, truth[-1, 0])
        off = np.hypot(*(again[:, 1:3] - truth[:len(again), 1:3]).T)
        print(f"{len(commands)} commands recorded; the plant they drive is {1e6 * off.max():.1f} um off at most", flush=True)
        # The ground truth is written with a resolution of 1 um.
        self.assertLess(float(off.max()), 5e-6)


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
