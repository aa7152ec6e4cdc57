#!/usr/bin/python3
"""`waymark world` on the command line.

usage: world_test.py PROGRAM [unittest options]
"""
import unittest
import xml.etree.ElementTree

from harness import InFolder
import golden_page


class World(InFolder):
    def test_circuit24_allows_a_good_lap(self):
        (check,) = self.run_here("world", "check", "circuit24", "--json").records
        self.assertTrue(check["good"])
        self.assertGreaterEqual(check["lap_m"], 16)
        self.assertGreaterEqual(check["min_clearance_m"], 0.35)
        self.assertGreaterEqual(check["two_tags_fraction"], 0.98)
        self.assertGreater(min(check["sharpest_left_1_m"], check["sharpest_right_1_m"]), 0.3, "curves of both hands")

    def test_a_poor_world_is_reported(self):
        (self.folder / "poor.yaml").write_text(
            "name: poor\ntag_family: tag36h11\ntag_size_m: 0.2\nanchor_id: 5\ntags:\n"
            "  - {id: 5, x_m: 1, y_m: 0.2, z_m: 0.1, facing_deg: 180}\npath_closed: false\npath_m: [[0, 0], [1, 0], [2, 0]]\n")
        outcome = self.run_here("world", "check", "poor.yaml")
        self.assertEqual(outcome.code, 1)
        golden_page.expect(self, "world", outcome.err)
        self.assertFalse(self.run_here("world", "check", "poor.yaml", "--json").records[0]["good"])

    def test_frames_and_axes_are_consistent_all_around_a_tag(self):
        outcome = self.run_here("world", "orbit", "circuit24", "--json", "-o", "orbit.svg")
        self.assertEqual(outcome.code, 0, outcome.err)
        (orbit,) = outcome.records
        self.assertTrue(orbit["good"])
        self.assertLess(orbit["closure"], 1e-12)
        xml.etree.ElementTree.parse(self.folder / "orbit.svg")
        self.assertEqual(self.run_here("world", "orbit", "circuit24", "--sigma-deg", "100").code, 1, "an axis turned over")
        outcome = self.run_here("world", "orbit", "circuit24", "-o", "orbit.gif")
        self.assertEqual(outcome.code, 1)
        self.assertIn("orbit.gif", outcome.err)


if __name__ == "__main__":
    unittest.main()
