"""A solution of the exercise "Marker Based Visual Loc", as submitted by a student. The pose of the robot is computed from the nearest tag and
propagated with odometry; a lidar keeps the robot away from walls. Source: "Marker-Based Visual Localization with AprilTags and Odometry Fusion",
sections "Choosing the Best Tag" and "Odometry Fusion and Outlier Rejection".
"""
import math
import random
from pathlib import Path

import cv2
import Frequency
import HAL
import numpy as np
import pyapriltags
import WebGUI
import yaml

TAG_SIZE_M = 0.24
HALF_BOARD_M = 0.01
FIELD_OF_VIEW_RAD = 1.02974  # of the robot's camera; using the image width as focal length is 13 % too large
FAR_M = 3.0  # beyond this a tag must agree with odometry …
JUMP_M = 0.4  # … within this
CUT_PX = 5  # a tag with a corner this close to the image edge may be cut off, which displaces its corners
FREE_M = 0.6
ROBOT_T_CAM = np.array([[0, 0, 1, 0.069], [-1, 0, 0, -0.047], [0, -1, 0, 0.117], [0, 0, 0, 1]], dtype=float)

tags = yaml.safe_load(Path("/resources/exercises/marker_visual_loc/apriltags_poses.yaml").read_text())["tags"]
detector = pyapriltags.Detector(families="tag36h11")


def world_T_tag(tag_id):
    """Tag frame: x right, y down, z into the tag. The file contains the centre of the board and the heading of a robot facing it."""
    x, y, z, yaw = tags[f"tag_{tag_id}"]["position"]
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[s, 0, c, x - HALF_BOARD_M * c], [-c, 0, s, y - HALF_BOARD_M * s], [0, -1, 0, z], [0, 0, 0, 1]])


def cam_T_tag(corners, K):
    """The pose of a tag in the camera frame from its corners [px], 4x4; None if PnP fails."""
    h = TAG_SIZE_M / 2
    points = np.array([[-h, h, 0], [h, h, 0], [h, -h, 0], [-h, -h, 0]])  # bottom left, bottom right, top right, top left
    found, rotation, translation = cv2.solvePnP(points, np.asarray(corners, dtype=float), K, None)
    if not found:
        return None
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = cv2.Rodrigues(rotation)[0], translation.ravel()
    return T


def planar(x, y, yaw):
    """A planar pose as a 3x3 matrix."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])


def fix(image):
    """(distance of the nearest tag, pose of the robot), or None."""
    gray = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    height, width = gray.shape
    f = width / 2 / math.tan(FIELD_OF_VIEW_RAD / 2)
    K = np.array([[f, 0, width / 2], [0, f, height / 2], [0, 0, 1]])
    nearest = None
    for tag in detector.detect(gray):
        cut = np.min(tag.corners) < CUT_PX or np.any(np.max(tag.corners, axis=0) > (width - CUT_PX, height - CUT_PX))
        T = cam_T_tag(tag.corners, K) if f"tag_{tag.tag_id}" in tags and not cut else None
        if T is not None and (nearest is None or np.linalg.norm(T[:3, 3]) < nearest[0]):
            world_T_robot = world_T_tag(tag.tag_id) @ np.linalg.inv(T) @ np.linalg.inv(ROBOT_T_CAM)
            yaw = math.atan2(world_T_robot[1, 0], world_T_robot[0, 0])
            nearest = np.linalg.norm(T[:3, 3]), planar(world_T_robot[0, 3], world_T_robot[1, 3], yaw)
    return nearest


def front_m():
    """The free distance ahead [m]."""
    laser = HAL.getLaserData()
    if not laser.values:
        return 0.0
    step = (laser.maxAngle - laser.minAngle) / max(len(laser.values) - 1, 1)
    ahead = [r for i, r in enumerate(laser.values) if abs(math.remainder(laser.minAngle + i * step, 2 * math.pi)) < 0.5]
    return min(ahead)


world_T_odom = None
turning, turn = False, 0.5
while True:
    seen = fix(HAL.getImage())
    odom = HAL.getOdom()
    odom_T_robot = planar(odom.x, odom.y, odom.yaw)
    if seen is not None:
        distance, pose = seen
        jump = math.inf if world_T_odom is None else np.linalg.norm((pose - world_T_odom @ odom_T_robot)[:2, 2])
        if world_T_odom is None or distance < FAR_M or jump < JUMP_M:
            world_T_odom = pose @ np.linalg.inv(odom_T_robot)
    if world_T_odom is not None:
        estimate = world_T_odom @ odom_T_robot
        WebGUI.showEstimatedPose((estimate[0, 2], estimate[1, 2], math.atan2(estimate[1, 0], estimate[0, 0])))
    if front_m() < FREE_M:
        if not turning:
            turn = random.choice((-0.5, 0.5))
        turning = True
    elif turning and front_m() > 2 * FREE_M:
        turning = False
    HAL.setV(0.0 if turning else 0.2)
    HAL.setW(turn if turning else random.uniform(-0.1, 0.1))
    Frequency.tick()
