#!/usr/bin/python3
"""A simulated lap, played as a robot whose camera is the Linux driver vivid: its images are written to the driver's output and captured by its camera.

usage: lap_player.py record PROGRAM FOLDER HZ   drive a lap of mbot-square with HZ images per second; store the robot's lines and its images as bytes
       lap_player.py play FOLDER DEVICE SLOWER  play that robot SLOWER times slower, with the images on the output DEVICE
"""
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import threading
import time

WIDTH, HEIGHT = 640, 480
ON_THE_WAY_S = 0.094  # an image waits for the output of the driver and for its camera; median as measured, 80 % within 0.07 to 0.12 s


def record(program, folder, rate_hz):
    """The lap through the tee of a shell, with rendered images."""
    import base64
    import cv2
    import numpy

    robot_lines = folder / "robot.jsonl"
    file = folder / "mbot.yaml"
    mbot = (pathlib.Path(__file__).parents[2] / "share/robots/mbot.yaml").read_text(encoding="utf-8")
    file.write_text(re.sub(r"camera_rate_hz: .*", f"camera_rate_hz: {rate_hz}", mbot), encoding="utf-8")
    robot = f"{shlex.quote(program)} robot-sim --world mbot-square --robot-file {shlex.quote(str(file))} --images --lockstep | tee {shlex.quote(str(robot_lines))}"
    (folder / "rendered.mcap").unlink(missing_ok=True)
    subprocess.run([program, "teach", "--robot", f"process:{robot}", "--robot-file", str(file), "--world", "mbot-square", "-o", str(folder / "rendered.mcap")], check=True)
    with open(folder / "images", "wb") as images, open(folder / "lines.jsonl", "w", encoding="utf-8") as lines:
        for line in map(json.loads, open(robot_lines, encoding="utf-8")):
            if line["type"] == "image":
                jpeg = numpy.frombuffer(base64.b64decode(line.pop("jpeg_base64")), numpy.uint8)
                image = cv2.imdecode(jpeg, cv2.IMREAD_GRAYSCALE)
                assert image.shape == (HEIGHT, WIDTH), image.shape
                images.write(image.tobytes())
            if line["type"] in ("image", "odometry", "truth"):
                lines.write(json.dumps(line) + "\n")


class Screen(threading.Thread):
    """Writes the image of the moment to the output again and again: without one the camera would show the driver's own pattern."""

    def __init__(self, device):
        super().__init__(daemon=True)
        words = ["v4l2-ctl", "-d", device, "--stream-out-mmap=3", "--stream-from=-"]
        self.output = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.image = bytes(WIDTH * HEIGHT)

    def run(self):
        while self.output.poll() is None:
            self.output.stdin.write(self.image)


def send(line):
    print(json.dumps(line), flush=True)


def play(folder, device, slower):
    screen = Screen(device)
    screen.start()
    send({"type": "hello", "protocol_version": 1, "name": "player", "sends": ["odometry", "truth"], "simulated": True})
    began = time.monotonic()
    events = []
    for line in map(json.loads, open(folder / "lines.jsonl", encoding="utf-8")):
        events.append((slower * line.pop("stamp_ns") * 1e-9 + (0 if line["type"] == "image" else ON_THE_WAY_S), line))
    with open(folder / "images", "rb") as images:
        for at, line in sorted(events, key=lambda event: event[0]):
            time.sleep(max(0, began + at - time.monotonic()))
            if line["type"] == "image":
                screen.image = images.read(WIDTH * HEIGHT)
                continue
            for key in ("speed_m_s", "yaw_rate_rad_s"):
                if key in line:
                    line[key] /= slower
            send({**line, "stamp_s": time.monotonic()})  # of the shown image, even if the machine is late
    screen.output.kill()
    os._exit(0)  # the thread may wait for the output, which is gone


if __name__ == "__main__":
    what, *words = sys.argv[1:]
    if what == "record":
        record(words[0], pathlib.Path(words[1]), float(words[2]))
    else:
        play(pathlib.Path(words[0]), words[1], float(words[2]))
