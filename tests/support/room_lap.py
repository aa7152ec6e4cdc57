"""A lap of a robot in a room with tags on its walls, as messages of a ROS 2 bag. Shares no code with Waymark."""
import math

import numpy as np
import ros2_bag as bag

WIDTH, HEIGHT, FOCAL = 640, 480, 520.0
TAG_SIZE_M = 0.2
FRAME = "camera_optical"
MOUNTING = np.array([0.1, 0, 0.25])  # of the camera, which faces ahead
OPTICAL_XYZW = (-0.5, 0.5, -0.5, 0.5)  # base axes to optical axes
START_NS = 1_700_000_000 * 10**9
LAP_S, LAPS = 32, 1.06
ODOMETRY_S, IMAGE_S = 0.05, 0.1
HALF_X, HALF_Y = 3.5, 2.5  # of the room
RADIUS_X, RADIUS_Y = 1.6, 0.9  # of the lap, an ellipse


def wall_tags():
    """{number: (centre, axes of the tag as columns: right, down, into the wall)}: seven on each wall."""
    tags = {}
    for wall, (nx, ny) in enumerate(((-1, 0), (0, -1), (1, 0), (0, 1))):
        inwards = np.array([nx, ny, 0.0])
        down = np.array([0, 0, -1.0])
        along = np.cross(down, -inwards)
        half, length = (HALF_X, HALF_Y) if nx else (HALF_Y, HALF_X)
        for i in range(7):
            centre = -half * inwards + (i - 3) * 0.29 * length * along + [0, 0, 0.3 + 0.05 * (i % 3)]
            tags[7 * wall + i] = (centre, np.column_stack([along, down, -inwards]))
    return tags


def pose(t, turned_rad):
    """x, y and heading of the base. The heading is turned to the left of the direction of motion."""
    phase = 2 * math.pi * t / LAP_S
    ahead = math.atan2(RADIUS_Y * math.cos(phase), -RADIUS_X * math.sin(phase))
    return RADIUS_X * math.cos(phase), RADIUS_Y * math.sin(phase), ahead + turned_rad


def seen(at, tags, random):
    """{number: corners TL, TR, BR, BL [px, centres at integers]} of the tags in the image of a robot at this pose."""
    x, y, yaw = at
    ahead, left = np.array([math.cos(yaw), math.sin(yaw), 0]), np.array([-math.sin(yaw), math.cos(yaw), 0])
    camera = np.array([x, y, 0]) + MOUNTING[0] * ahead + [0, 0, MOUNTING[2]]
    rows = np.array([-left, [0, 0, -1], ahead])  # optical axes in the map
    square = TAG_SIZE_M / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    found = {}
    for number, (centre, axes) in tags.items():
        sight = centre - camera
        if sight @ axes[:, 2] < 0.35 * np.linalg.norm(sight):
            continue
        points = (centre + square @ axes.T - camera) @ rows.T
        if points[:, 2].min() < 0.2:
            continue
        corners = FOCAL * points[:, :2] / points[:, 2:] + [WIDTH / 2 - 0.5, HEIGHT / 2 - 0.5]
        inside = (corners > 3).all() and (corners < [WIDTH - 4, HEIGHT - 4]).all()
        if inside and np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).min() > 14:
            found[number] = corners + random.normal(0, 0.2, corners.shape)
    return found


class Wheels:
    """Odometry whose distances are 1 % long and whose turns are 2 % long."""

    def __init__(self, at):
        self.last = at
        self.at = (0.0, 0.0, 0.0)

    def follow(self, at):
        (x, y, yaw), (x0, y0, yaw0) = at, self.last
        dx, dy = 1.01 * (x - x0), 1.01 * (y - y0)
        turn = 1.02 * math.remainder(yaw - yaw0, 2 * math.pi)
        ox, oy, oyaw = self.at
        rotation = oyaw - yaw0
        self.at = (ox + math.cos(rotation) * dx - math.sin(rotation) * dy, oy + math.sin(rotation) * dx + math.cos(rotation) * dy,
                   oyaw + turn)
        self.last = at
        return self.at


def lap(turned_rad=0.0, motion_ahead_s=0, topic=True, transforms=False, blind_s=(0, 0), seed=1):
    """Messages for ros2_bag.write(). The stamps of odometry are ahead of those of the images by `motion_ahead_s`. Odometry is on /odom
    (`topic`), on /tf (`transforms`), both or none. No tag is seen between the two times of `blind_s`."""
    random = np.random.default_rng(seed)
    k = [FOCAL, 0, WIDTH / 2 - 0.5, 0, FOCAL, HEIGHT / 2 - 0.5, 0, 0, 1]
    messages = [(START_NS, "/tf_static", bag.TRANSFORMS, bag.transform(START_NS, "base_link", FRAME, MOUNTING, OPTICAL_XYZW)),
                (START_NS, "/camera_info", bag.INFO, bag.camera_info(START_NS, FRAME, WIDTH, HEIGHT, k, [0.0] * 5))]
    tags = wall_tags()
    wheels = Wheels(pose(0, turned_rad))
    for i in range(round(LAP_S * LAPS / ODOMETRY_S)):
        t = i * ODOMETRY_S
        at = pose(t, turned_rad)
        ns = START_NS + round(1e9 * t)
        x, y, yaw = wheels.follow(at)
        stamp = ns + motion_ahead_s * 10**9
        if topic:
            messages.append((ns, "/odom", bag.ODOMETRY, bag.odometry(stamp, x, 0.25, y, yaw)))
        if transforms:
            turn = (0, 0, math.sin(yaw / 2), math.cos(yaw / 2))
            messages.append((ns, "/tf", bag.TRANSFORMS, bag.transform(stamp, "odom", "base_link", (x, y, 0), turn)))
        if i % round(IMAGE_S / ODOMETRY_S) == 0:
            visible = {} if blind_s[0] < t < blind_s[1] else seen(at, tags, random)
            messages.append((ns, "/detections", bag.DETECTIONS, bag.detections(ns, FRAME, visible)))
    return messages


def tag_errors_m(found):
    """Distances of the tags of a map from their true positions, after alignment. `found`: {number: position}."""
    numbers = sorted(found)
    true = np.array([wall_tags()[n][0] for n in numbers])
    mapped = np.array([found[n] for n in numbers])
    a, b = true - true.mean(axis=0), mapped - mapped.mean(axis=0)
    u, _, vt = np.linalg.svd(b.T @ a)
    rotation = vt.T @ np.diag([1, 1, np.linalg.det(vt.T @ u.T)]) @ u.T
    return np.linalg.norm(a - b @ rotation.T, axis=1)
