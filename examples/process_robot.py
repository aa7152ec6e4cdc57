#!/usr/bin/python3
"""A robot in sixty lines, for `waymark teach --robot "process:python3 examples/process_robot.py"` (docs/formats/robot-process.md).

Replace the four parts marked HARDWARE with those of your robot. This one is simulated: two wheels on a floor, and a camera that
sees twelve tags on posts around it. It also shows how a camera with its own detector sends tags instead of images.
"""
import json
import math
import queue
import sys
import threading
import time

TAGS = {i: (3 * math.cos(a), 3 * math.sin(a), 0.3, a + math.pi) for i, a in enumerate(i * math.pi / 6 for i in range(12))}
SIZE, F, CX, CY = 0.30, 442.0, 323.5, 247.0  # tags [m]; the camera of share/robots/limo.yaml [px], 0.084 m ahead, 0.18 m up
orders = queue.SimpleQueue()

def send(kind, **values):
    print(json.dumps({"type": kind, "stamp_s": time.monotonic(), **values}), flush=True)


def listen():  # reads every line immediately, so that no command waits in a pipe
    for line in sys.stdin:
        try:
            orders.put(json.loads(line))
        except json.JSONDecodeError:
            print(f"skipped, not JSON: {line.strip()[:80]}", file=sys.stderr)
    orders.put({"type": "bye"})  # waymark and its watchdog have exited: stop


def project(x, y, yaw, corner):  # pixel of a map point; None if it is outside the image
    dx, dy = corner[0] - x, corner[1] - y
    ahead, left = math.cos(yaw) * dx + math.sin(yaw) * dy - 0.084, math.cos(yaw) * dy - math.sin(yaw) * dx
    u, v = (CX - F * left / ahead, CY - F * (corner[2] - 0.18) / ahead) if ahead > 0.3 else (-1, -1)
    return [u, v] if 0 < u < 640 and 0 < v < 480 else None


def look(x, y, yaw):  # HARDWARE: your camera. Corners: top left, top right, bottom right, bottom left as seen by a viewer
    tags = []
    for tag, (tx, ty, tz, facing) in TAGS.items():
        right, h = (-math.sin(facing), math.cos(facing)), SIZE / 2  # the viewer faces opposite to the tag
        corners = [project(x, y, yaw, (tx + s * h * right[0], ty + s * h * right[1], tz + t * h))
                   for s, t in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
        if all(corners) and (x - tx) * math.cos(facing) + (y - ty) * math.sin(facing) > 0:
            tags.append({"tag": f"tag36h11:{tag}", "corners_px": corners, "corner_sigma_px": 0.3})
    send("detections", tags=tags)


def main():
    threading.Thread(target=listen, daemon=True).start()
    send("hello", protocol_version=1, name="two wheels", sends=["odometry", "detections"])
    x, y, yaw, speed, turn, last_order = 0.0, -1.0, 0.0, 0.0, 0.0, time.monotonic()
    for tick in range(sys.maxsize):
        time.sleep(0.02)
        while not orders.empty():
            order = orders.get()
            if order["type"] == "bye":
                return  # HARDWARE: stop the motors here
            if order["type"] == "velocity":
                speed, turn, last_order = order["speed_m_s"], order["yaw_rate_rad_s"], time.monotonic()
        if time.monotonic() - last_order > 0.5:
            speed = turn = 0.0  # no command for 0.5 s, although the watchdog sends twenty per second
        x, y, yaw = x + speed * math.cos(yaw) * 0.02, y + speed * math.sin(yaw) * 0.02, yaw + turn * 0.02  # HARDWARE: wheels
        send("odometry", x_m=x, y_m=y, yaw_rad=yaw, speed_m_s=speed, yaw_rate_rad_s=turn)  # HARDWARE: measured by the wheels
        if tick % 5 == 0:
            look(x, y, yaw)


main()
