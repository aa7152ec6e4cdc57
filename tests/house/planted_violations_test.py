#!/usr/bin/python3
"""Plants one violation after another in a small copy of the repository and expects each to be found."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True


class PlantedViolations(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)
        shutil.copytree(ROOT / "cmake", self.root / "cmake")
        for room in ("base", "geometry"):
            shutil.copytree(ROOT / "waymark" / room, self.root / "waymark" / room)

    def tearDown(self):
        self.folder.cleanup()

    def check_includes(self):
        return subprocess.run([sys.executable, ROOT / "tools/check_includes.py", self.root], capture_output=True, text=True)

    def configure(self, uses):
        (self.root / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(Planted LANGUAGES NONE)\n"
            "include(cmake/WaymarkRoom.cmake)\nwaymark_check_edges(%s)\n" % uses)
        return subprocess.run(["cmake", "-S", self.root, "-B", self.root / "build"], capture_output=True, text=True)

    def test_the_unchanged_copy_passes(self):
        self.assertEqual(self.check_includes().returncode, 0, self.check_includes().stdout)
        self.assertEqual(self.configure("camera geometry base").returncode, 0)

    def test_a_forbidden_edge_stops_the_configure(self):
        result = self.configure("geometry camera")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("'geometry' may not use", " ".join(result.stderr.split()))

    def test_an_unknown_room_stops_the_configure(self):
        self.assertIn("not in cmake/rooms.txt", " ".join(self.configure("attic base").stderr.split()))

    def test_a_header_of_an_unlinked_room_is_found(self):
        (self.root / "waymark/base/planted.cpp").write_text('#include "waymark/geometry/se3.hpp"\n')
        result = self.check_includes()
        self.assertEqual(result.returncode, 1)
        self.assertIn("planted.cpp:1: room 'base' includes waymark/geometry/se3.hpp", result.stdout)

    def test_a_third_party_header_where_it_does_not_belong_is_found(self):
        (self.root / "waymark/geometry/planted.hpp").write_text("#pragma once\n\n#include <yaml-cpp/yaml.h>\n")
        result = self.check_includes()
        self.assertEqual(result.returncode, 1)
        self.assertIn("planted.hpp:3: headers of room 'geometry' may not include <yaml-cpp/yaml.h>", result.stdout)

    def test_a_private_third_party_header_in_a_public_header_is_found(self):
        room = self.root / "waymark/tags"
        room.mkdir()
        (room / "CMakeLists.txt").write_text("waymark_room(tags USES samples)\n")
        (room / "fine.cpp").write_text("#include <apriltag/apriltag.h>\n")
        self.assertEqual(self.check_includes().returncode, 0, self.check_includes().stdout)
        (room / "planted.hpp").write_text("#include <apriltag/apriltag.h>\n")
        self.assertIn("headers of room 'tags' may not include <apriltag/apriltag.h>", self.check_includes().stdout)

    def check_public_headers(self, doors, *words):
        (self.root / "tests/consumer").mkdir(parents=True, exist_ok=True)
        (self.root / "tests/consumer/CMakeLists.txt").write_text("set(examples )\n")
        if doors is not None:
            (self.root / "cmake/public_headers.txt").write_text("# by hand\n" + "".join(f"{door}\n" for door in doors))
        return subprocess.run([sys.executable, ROOT / "tools/update_public_headers.py", *words, self.root], capture_output=True, text=True)

    def test_a_header_that_a_public_one_includes_must_be_listed(self):
        missing = self.check_public_headers(["waymark/geometry/planar.hpp"], "--check")
        self.assertEqual(missing.returncode, 1)
        self.assertIn("waymark/geometry/se2.hpp is missing", missing.stdout)
        self.assertEqual(self.check_public_headers(None).returncode, 0)
        self.assertEqual(self.check_public_headers(None, "--check").returncode, 0)
        self.assertIn("waymark/geometry/se2.hpp", (self.root / "cmake/public_headers.txt").read_text())
        with open(self.root / "cmake/public_headers.txt", "a") as page:
            page.write("waymark/geometry/uncertainty.hpp\n")
        self.assertIn("nothing public includes waymark/geometry/uncertainty.hpp", self.check_public_headers(None, "--check").stdout)

    def test_a_public_header_must_exist_and_its_room_be_installed(self):
        self.assertIn("there is no waymark/base/attic.hpp", self.check_public_headers(["waymark/base/attic.hpp"]).stdout)
        (self.root / "waymark/base/CMakeLists.txt").write_text("waymark_room(base INTERNAL)\n")
        self.assertIn("waymark/base/error.hpp is public", self.check_public_headers(["waymark/base/error.hpp"]).stdout)

    def test_a_program_of_others_may_include_public_headers_only(self):
        self.check_public_headers(["waymark/geometry/planar.hpp"])
        (self.root / "tests/consumer/main.cpp").write_text("#include <waymark/geometry/se2.hpp>\n")
        result = self.check_public_headers(None, "--check")
        self.assertEqual(result.returncode, 1)
        self.assertIn("tests/consumer/main.cpp: includes waymark/geometry/se2.hpp, which is not public", result.stdout)

    def test_a_room_without_a_row_is_found(self):
        (self.root / "waymark/attic").mkdir()
        self.assertIn("room 'attic' is not in cmake/rooms.txt", self.check_includes().stdout)


if __name__ == "__main__":
    unittest.main()
