#!/usr/bin/python3
"""Runs as root in the virtual machine of machine.py: the Linux camera driver vivid, and gamepads through uinput.

usage: guest_test.py PROGRAM SOURCES LAP [unittest options]

LAP: a folder of lap_player.py."""
import csv
import json
import os
import pathlib
import shlex
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM, ROOT, LAP = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
sys.path[:0] = [str(ROOT / "tests/cli"), str(ROOT / "tests/devices")]
import pad
import images

CAMERA, OUTPUT = "/dev/video0", "/dev/video1"
WIDTH, HEIGHT = 640, 480
SLOWER = 2  # playing time of the lap in the machine divided by its duration, because the machine is slower
TAGS = [("tag36h11", 7, 80, 100, 12), ("tag36h11", 42, 360, 180, 20)]
DRIVER = pathlib.Path("/sys/bus/platform/drivers/vivid")


def v4l2(*words):
    done = subprocess.run(["v4l2-ctl", *words], capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


class Devices(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.environment = {**os.environ, "SDL_VIDEODRIVER": "dummy", "SDL_JOYSTICK_DISABLE_UDEV": "1", "XDG_RUNTIME_DIR": str(self.folder)}

    def start(self, *words):
        process = subprocess.Popen([PROGRAM, *words], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env=self.environment)
        self.addCleanup(process.kill)
        return process

    def run_here(self, *words, code=0):
        process = self.start(*words)
        out, err = process.communicate(timeout=240)
        self.assertEqual(process.returncode, code, f"{words}\n{out[-2000:]}\n{err}")
        return out, err


class Camera(Devices):
    def connect(self, fourcc):
        """Connects the output of vivid to its camera."""
        v4l2("-d", CAMERA, "-i", "3")
        v4l2("-d", OUTPUT, "-o", "1")
        v4l2("-d", CAMERA, "-c", "loop_video=1,osd_text_mode=2")  # no text over the images
        for device in (OUTPUT, CAMERA):
            v4l2("-d", device, "--set-dv-bt-timings", "index=0")  # 640 x 480
        v4l2("-d", OUTPUT, f"--set-fmt-video-out=width={WIDTH},height={HEIGHT},pixelformat={fourcc}")

    def feed(self, fourcc):
        """Plays an image with tags on the output of vivid."""
        rows = images.scene(WIDTH, HEIGHT, TAGS)
        frame = b"".join(bytes(row) if fourcc == "GREY" else bytes(part for value in row for part in (value, 128)) for row in rows)
        (self.folder / "frames").write_bytes(frame * 4)
        self.connect(fourcc)
        fed = subprocess.Popen(["v4l2-ctl", "-d", OUTPUT, "--stream-out-mmap=3", "--stream-loop", f"--stream-from={self.folder}/frames"],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(fed.wait)
        self.addCleanup(fed.kill)
        time.sleep(2)

    def test_1_is_listed_with_its_modes_and_controls(self):
        out, _ = self.run_here("cameras", "--json")
        camera = next(one for one in json.loads(out)["cameras"] if one["path"] == CAMERA)
        self.assertIn("vivid", camera["card"])
        formats = {mode["format"]: mode["readable"] for mode in camera["modes"]}
        self.assertTrue(formats["YUYV"] and formats["GREY"], formats)
        self.assertFalse(formats.get("BGR3", False), formats)
        self.assertIn("brightness", {control["name"] for control in camera["controls"]})
        print(f"vivid: {len(camera['modes'])} formats and sizes, {len(camera['controls'])} controls", flush=True)

    def test_2_its_images_have_stamps(self):
        out, err = self.run_here("detect", f"v4l2:{CAMERA},size={WIDTH}x{HEIGHT}", "--json", "--duration-s", "4")
        records = [json.loads(line) for line in out.splitlines()]
        self.assertGreater(len(records), 8, err)
        stamps = [record["stamp_s"] for record in records]
        steps = [b - a for a, b in zip(stamps, stamps[1:])]
        self.assertGreater(min(steps), 0)
        self.assertLess(abs(stamps[-1] - time.time()), 60, "times since 1970, although vivid uses the steady clock")
        print(f"vivid's own pattern: {len(records)} images in {stamps[-1] - stamps[0]:.2f} s, smallest step {1e3 * min(steps):.1f} ms", flush=True)

    def tags_through(self, fourcc):
        self.feed(fourcc)
        out, err = self.run_here("detect", f"v4l2:{CAMERA},size={WIDTH}x{HEIGHT},format={fourcc}", "--json", "--duration-s", "6")
        records = [json.loads(line) for line in out.splitlines()]
        seen = [record for record in records if len(record["detections"]) == len(TAGS)]
        self.assertGreater(len(seen), 0.9 * len(records) - 1, err)
        self.assertGreater(len(seen), 2)
        worst = 0.0
        for record in seen:
            for found, (_, number, x, y, cell) in zip(sorted(record["detections"], key=lambda one: one["id"]), TAGS):
                self.assertEqual(found["id"], number)
                side = 8 * cell
                true = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
                worst = max(worst, *(abs(a - b) for corner, at in zip(found["corners_px"], true) for a, b in zip(corner, at)))
        self.assertLess(worst, 0.2, "px")
        print(f"{fourcc}: {len(seen)} of {len(records)} images with both tags, corners within {worst:.3f} px", flush=True)

    def test_3_tags_keep_their_corners_through_the_driver_as_grey(self):
        self.tags_through("GREY")

    def test_3_tags_keep_their_corners_through_the_driver_as_yuyv(self):
        self.tags_through("YUYV")

    def test_4_sets_controls_and_rejects_values_outside_their_range(self):
        least = int(v4l2("-d", CAMERA, "-l").split("brightness")[1].split("min=")[1].split()[0])  # of the selected input
        self.run_here("detect", f"v4l2:{CAMERA},brightness={least + 90}", "--duration-s", "0.5")
        self.assertIn(f"brightness: {least + 90}", v4l2("-d", CAMERA, "-C", "brightness"))
        _, err = self.run_here("detect", f"v4l2:{CAMERA},brightness=9000", "--duration-s", "0.5", code=2)
        self.assertRegex(err, rf"brightness.*\b{least}\b.* {least + 255}\b")

    def test_5_reports_the_program_that_uses_the_camera(self):
        other = subprocess.Popen(["v4l2-ctl", "-d", CAMERA, "--stream-mmap=3", "--stream-count=10000"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(other.wait)
        self.addCleanup(other.kill)
        time.sleep(1)
        _, err = self.run_here("detect", f"v4l2:{CAMERA}", code=1)
        self.assertRegex(err, rf"{CAMERA}.*v4l2-ctl|v4l2-ctl.*{CAMERA}")
        self.assertIn(str(other.pid), err)

    def test_6_a_lap_is_taught_through_the_driver(self):
        """devices_test.py maps it, which would take minutes here."""
        self.connect("GREY")
        player = shlex.join(["/usr/bin/python3", str(ROOT / "tests/devices/lap_player.py"), "play", LAP, OUTPUT, str(SLOWER)])
        _, words = self.run_here("teach", "--robot", f"process:{player}", "--robot-file", "mbot", "--world", "mbot-square", "--camera-source",
                                 f"v4l2:{CAMERA},size={WIDTH}x{HEIGHT},format=GREY", "-o", "/mnt/lap.mcap")
        print(words, flush=True)
        self.assertNotRegex(words, r"clock\b.* back")

    def test_7_waits_for_an_unplugged_camera(self):
        process = self.start("detect", f"v4l2:{CAMERA}", "--json")
        self.assertTrue(process.stdout.readline(), "no image before the plug is pulled")
        (DRIVER / "unbind").write_text("vivid.0")
        time.sleep(4)
        (DRIVER / "bind").write_text("vivid.0")
        time.sleep(8)
        process.send_signal(signal.SIGINT)
        _, words = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, words)
        self.assertIn("unplugged", words)
        self.assertIn("connected", words)


class Gamepad(Devices):
    def speeds(self, recording):
        """(time since the start [s], speed [m/s]) from the odometry of a recording."""
        self.run_here("convert", recording, "odometry.csv", "--kind", "odometry")
        with open(self.folder / "odometry.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        began = int(rows[0]["t_ns"])
        return [((int(row["t_ns"]) - began) * 1e-9, float(row["speed_m_s"])) for row in rows]

    def test_drives_stops_when_unplugged_and_ends_the_lap_with_y(self):
        held = pad.Pad()
        time.sleep(1)
        process = self.start("teach", "--world", "circuit24", "--driver", "gamepad", "-o", "lap.mcap")
        time.sleep(6)
        held.press("left shoulder")
        held.push("left y", -1)
        time.sleep(4)
        held.unplug()  # with the button held and the stick forward
        time.sleep(4)
        again = pad.Pad()
        time.sleep(2)
        again.press("left shoulder")
        again.push("left y", -0.6)
        time.sleep(4)
        again.push("left y", 0)
        again.press("left shoulder", down=False)
        time.sleep(2)
        again.press("y")
        _, words = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 1, "fails only because a straight line is not a lap: " + words)
        for pattern in ("left shoulder", "gamepad .*unplugged", "gamepad .*connected"):
            self.assertRegex(words, pattern)
        speeds = self.speeds("lap.mcap")
        moving = [speed > 0.05 for _, speed in speeds]
        drives = [i for i in range(1, len(moving)) if moving[i] and not any(moving[max(0, i - 20):i])]
        self.assertEqual(len(drives), 2, "drove, stopped while the gamepad was unplugged, and drove again")
        first, second = max(speed for _, speed in speeds[:drives[1]]), max(speed for _, speed in speeds[drives[1]:])
        self.assertGreater(first, 1.3 * second)
        print(f"by uinput and SDL: {first:.2f} m/s at full stick, {second:.2f} m/s at 0.6 of it, unplugged in between", flush=True)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
