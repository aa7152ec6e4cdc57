"""A solution of the exercise as its students publish it. The nearest tag gives the pose, by PnP and the yaw of the file. Without a tag in view, odometry
propagates it from the last tag. The robot drives until the laser detects an obstacle, then turns by a random angle.
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

SIZE = 0.24
CORNERS = np.array([[-SIZE / 2, SIZE / 2, 0], [SIZE / 2, SIZE / 2, 0], [SIZE / 2, -SIZE / 2, 0], [-SIZE / 2, -SIZE / 2, 0]], dtype=np.float32)
# From a body (x forward, y left, z up) to the optical frame of what it looks along (x right, y down, z forward).
OPTICAL = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], dtype=float)
CAMERA = [0.069, -0.047, 0.107]  # on the robot, from its SDF

tags = yaml.safe_load(Path("/resources/exercises/marker_visual_loc/apriltags_poses.yaml").read_text())["tags"]
detector = pyapriltags.Detector(searchpath=["apriltags"], families="tag36h11")


def matrix(rotation, translation):
    result = np.eye(4)
    result[:3, :3] = rotation
    result[:3, 3] = np.ravel(translation)
    return result


def about_z(angle):
    return np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])


def pose_by_tag(detection, image):
    """(distance, (x, y, yaw)) of the robot by one tag; None where PnP finds no pose."""
    height, width = image.shape[:2]
    focal = width / (2 * math.tan(1.02974 / 2))
    lens = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    found, rvec, tvec = cv2.solvePnP(CORNERS, np.array(detection.corners, dtype=np.float32), lens, np.zeros((4, 1)))
    if not found:
        return None
    x, y, z, yaw = tags[f"tag_{detection.tag_id}"]["position"]
    world_tag = matrix(about_z(yaw) @ OPTICAL, [x, y, z])
    camera_tag = matrix(cv2.Rodrigues(rvec)[0], tvec)
    robot_camera = matrix(OPTICAL, CAMERA)
    world_robot = world_tag @ np.linalg.inv(camera_tag) @ np.linalg.inv(robot_camera)
    return float(np.linalg.norm(tvec)), (world_robot[0, 3], world_robot[1, 3], math.atan2(world_robot[1, 0], world_robot[0, 0]))


def moved(pose, before, now):
    """The pose after the robot went from one reading of odometry to another."""
    dx, dy = now.x - before.x, now.y - before.y
    forward = math.cos(before.yaw) * dx + math.sin(before.yaw) * dy
    left = -math.sin(before.yaw) * dx + math.cos(before.yaw) * dy
    x, y, yaw = pose
    return (x + math.cos(yaw) * forward - math.sin(yaw) * left, y + math.sin(yaw) * forward + math.cos(yaw) * left, yaw + now.yaw - before.yaw)


def obstacle(laser):
    ahead = [laser.values[i] for i in [*range(330, 360), *range(0, 31)]]
    return min(ahead) < 0.6


anchor = anchor_odom = None
turn_left, last_yaw = 0.0, None
while True:
    image = HAL.getImage()
    odom = HAL.getOdom()
    laser = HAL.getLaserData()
    found = [pose_by_tag(detection, image) for detection in detector.detect(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)) if f"tag_{detection.tag_id}" in tags]
    found = [one for one in found if one is not None]
    if found:
        anchor, anchor_odom = min(found)[1], odom
    if anchor is not None:
        WebGUI.showEstimatedPose(moved(anchor, anchor_odom, odom))
    WebGUI.showImage(image)
    if turn_left > 0:
        turn_left -= math.remainder(odom.yaw - last_yaw, 2 * math.pi)
    elif obstacle(laser):
        turn_left = random.uniform(0.8, 2.5)
    last_yaw = odom.yaw
    HAL.setV(0.0 if turn_left > 0 else 0.2)
    HAL.setW(0.5 if turn_left > 0 else 0.0)
    Frequency.tick()
