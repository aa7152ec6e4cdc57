#!/usr/bin/python3
"""The ament package in ros2/, checked without ROS: XML, Python, YAML, and the flags of its commands.

usage: package_test.py PROGRAM
"""
import ast
import pathlib
import re
import subprocess
import sys
import unittest

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import installed  # noqa: E402

PROGRAM = sys.argv[1]
PACKAGE = pathlib.Path(__file__).resolve().parent.parent.parent / "ros2"


def commands(tree):
    """The word lists of cmd=; a placeholder for each word that is not a constant."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "ExecuteProcess":
            for keyword in node.keywords:
                if keyword.arg == "cmd":
                    yield [item.value if isinstance(item, ast.Constant) else None for item in keyword.value.elts]


class Package(unittest.TestCase):
    def test_package_xml_is_well_formed_and_complete(self):
        found = subprocess.run([installed.program("xmllint", "libxml2-utils"), "--nonet", "--xpath", "string(/package[@format='3']/name)", PACKAGE / "package.xml"],
                               capture_output=True, text=True)
        self.assertEqual((found.returncode, found.stdout.strip()), (0, "waymark"), found.stderr)
        version = re.search(r"VERSION ([\d.]+)", (PACKAGE.parent / "CMakeLists.txt").read_text().split("project(", 1)[1]).group(1)
        self.assertIn(f"<version>{version}</version>", (PACKAGE / "package.xml").read_text())

    def test_launch_files_contain_valid_commands(self):
        files = sorted((PACKAGE / "launch").glob("*.launch.py"))
        self.assertEqual(len(files), 3)
        for file in files:
            tree = ast.parse(file.read_text(), str(file))
            self.assertIn("generate_launch_description", [node.name for node in tree.body if isinstance(node, ast.FunctionDef)])
            imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names}
            used = {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
            self.assertLessEqual(used - {"generate_launch_description"}, imported, file)
            found = list(commands(tree))
            self.assertGreater(len(found), 0, file)
            for words in found:
                self.assertEqual(words[0], "waymark")
                flags = [word for word in words if word and word.startswith("--")]
                verb = words[1]
                help_text = subprocess.run([PROGRAM, verb, "--help-all"], capture_output=True, text=True).stdout
                for flag in flags:
                    self.assertIn(flag, help_text, f"{file}: {verb} {flag}")

    def test_rviz_configuration_shows_topics_that_are_published(self):
        manager = yaml.safe_load((PACKAGE / "rviz/waymark.rviz").read_text())["Visualization Manager"]
        topics = {display["Topic"]["Value"] for display in manager["Displays"] if "Topic" in display}
        sources = "".join((PACKAGE.parent / "waymark/app" / name).read_text() for name in ("live/ros2_node.cpp", "robot/ros2_robot_sim.cpp"))
        for topic in topics:
            self.assertIn(f'"{topic}"', sources)
        heard = {tool["Topic"]["Value"] for tool in manager["Tools"] if "Topic" in tool}
        self.assertEqual(heard, set(re.findall(r'kInitialPoseTopic = "(.*)"', (PACKAGE.parent / "waymark/robots/ros2/initial_pose.hpp").read_text())))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
