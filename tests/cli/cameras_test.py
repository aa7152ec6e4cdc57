#!/usr/bin/python3
"""A robot with a front and a rear camera: taught, mapped and replayed, in simulation and as a process."""
import math

from harness import PROGRAM, InFolder, unittest
import golden_page

WORLD = "ring.yaml"
TAGS = 24
ROBOT = ("--robot-file", "limo-front-rear")
SIM = f"process:exec '{PROGRAM}' robot-sim --world {WORLD} --robot-file limo-front-rear --lockstep"
OF_CAMERA = ("/camera_info", "/tag_detections", "/tag_corner_covariances")


def ring():
    """Tags around a circular path, facing its centre, so that both cameras have as many tags in view."""
    lines = ["name: ring", "tag_family: tag36h11", "tag_size_m: 0.16", "anchor_id: 0", "tags:"]
    for number in range(TAGS):
        angle = 360 / TAGS * number
        x, y = 2.6 * math.cos(math.radians(angle)), 2.6 * math.sin(math.radians(angle))
        lines.append(f"  - {{id: {number}, x_m: {x:.3f}, y_m: {y:.3f}, z_m: 0.3, facing_deg: {angle - 180:.1f}}}")
    path = [f"[{math.cos(a):.3f}, {math.sin(a):.3f}]" for a in (math.radians(5 * i - 65) for i in range(72))]
    return "\n".join([*lines, f"path_m: [{', '.join(path)}]", "path_closed: true", ""])


class TwoCameras(InFolder):
    def setUp(self):
        super().setUp()
        (self.folder / WORLD).write_text(ring())

    def topics_of(self, recording):
        return {topic["topic"]: topic["messages"] for topic in self.run_here("info", recording, "--json").records[0]["topics"]}

    def test_in_simulation(self):
        taught = self.run_here("teach", "--world", WORLD, *ROBOT, "--seed", 2, "-o", "two.mcap", "--json")
        self.assertEqual(taught.code, 0, taught.err)
        alone = self.run_here("teach", "--world", WORLD, "--robot-file", "limo", "--seed", 2, "-o", "one.mcap", "--json")
        self.assertGreater(taught.records[0]["detections"], 1.5 * alone.records[0]["detections"])
        topics = self.topics_of("two.mcap")
        for topic in OF_CAMERA:
            for camera in ("front", "rear"):
                self.assertIn(f"/{camera}{topic}", topics)
        self.assertEqual(topics["/front/tag_detections"], topics["/rear/tag_detections"])

        mapped = self.run_here("map", "two.mcap", "-o", "two", "--json")
        self.assertEqual(mapped.code, 0, mapped.err)
        self.assertIn("front_optical, rear_optical", mapped.err)
        golden_page.expect(self, "map", mapped.err)
        single = self.run_here("map", "one.mcap", "-o", "one", "--json").records[0]
        report = mapped.records[0]
        self.assertEqual((single["tags"], report["tags"]), (TAGS, TAGS))
        self.assertLess(report["tag_rmse_m"], 1.25 * single["tag_rmse_m"])
        front = self.run_here("map", "two.mcap", "-o", "front", "--camera-frame", "front_optical", "--json")
        self.assertEqual(front.code, 0, front.err)
        self.assertNotIn("warning", front.err, "the other camera is ignored without a warning")
        self.assertEqual(2 * front.records[0]["frames"], report["frames"])

        for method in ("riekf", "anchor"):
            replayed = self.run_here("replay", "two", "--world", WORLD, "--seed", 7, "--method", method, "-o", f"{method}.mcap", "--json")
            self.assertEqual(replayed.code, 0, replayed.err)
            self.assertTrue(replayed.records[0]["finished"])
            self.assertLess(replayed.records[0]["cross_track_rmse_m"], 0.05)
            self.assertIn("/rear/tag_detections", self.topics_of(f"{method}.mcap"))
        located = self.run_here("localize", "riekf.mcap", "--map", "two", "--json")
        self.assertEqual(located.code, 0, located.err)
        self.assertGreater(located.records[0]["accepted"], 0.9 * located.records[0]["observations"])

    def test_as_a_process(self):
        taught = self.run_here("teach", "--robot", SIM, "--world", WORLD, *ROBOT, "-o", "lap.mcap", "--json")
        self.assertEqual(taught.code, 0, taught.err)
        self.assertIn("/rear/tag_detections", self.topics_of("lap.mcap"))
        mapped = self.run_here("map", "lap.mcap", "-o", "map", "--json")
        self.assertEqual(mapped.code, 0, mapped.err)
        self.assertEqual(mapped.records[0]["tags"], TAGS)
        replayed = self.run_here("replay", "map", "--robot", SIM + " --seed 7", "--world", WORLD, "-o", "replay.mcap", "--json")
        self.assertEqual(replayed.code, 0, replayed.err)
        self.assertTrue(replayed.records[0]["finished"])
        self.assertLess(replayed.records[0]["cross_track_rmse_m"], 0.05)

    def test_a_camera_that_is_not_in_the_robot_file_is_skipped(self):
        taught = self.run_here("teach", "--robot", SIM, "--world", WORLD, "--robot-file", "limo", "-o", "lap.mcap", "--json")
        self.assertIn("'front'", taught.err)
        golden_page.expect(self, "robots", taught.err)
        self.assertNotIn("/front/tag_detections", self.topics_of("lap.mcap"))


if __name__ == "__main__":
    unittest.main()
