import numpy as np


def nearest(seen):
    return min(seen, key=lambda s: np.linalg.norm(s[1].translation), default=None)


def fix(name, cam_T_tag):
    T = (tag_map[name].map_T_tag @ cam_T_tag.inverse() @ robot.base_T_cam.inverse()).matrix()
    return geometry.SE2(T[0, 3], T[1, 3], np.arctan2(T[1, 0], T[0, 0]))


def carried(fixed, odom_then, odom_now):
    return fixed @ odom_then.inverse() @ odom_now


def accepted(distance_m, jump_m):
    return distance_m < FAR_M or jump_m < JUMP_M


def wrapped(angle):
    return np.arctan2(np.sin(angle), np.cos(angle))


def update(x, P, z, R):
    K = P @ np.linalg.inv(P + R)
    apart = z - x
    apart[2] = wrapped(apart[2])
    x = x + K @ apart
    x[2] = wrapped(x[2])
    return x, P - K @ P


WRONG = {
    "the farthest tag": ("return min(seen, key", "return max(seen, key", "there is a nearer one: what is the distance of a tag that is not"),
    "depth alone": ("np.linalg.norm(s[1].translation)", "s[1].translation[2]", "there is a nearer one: what is the distance of a tag that is not"),
    "the camera for the robot": (" @ robot.base_T_cam.inverse()", "", "that is the pose of the camera, not of the robot"),
    "mounting not inverted": ("robot.base_T_cam.inverse()", "robot.base_T_cam", "m from the true position: write the frames in a row"),
    "heading of the wrong column": ("np.arctan2(T[1, 0], T[0, 0])", "np.arctan2(T[1, 1], T[0, 1])", "the position is correct, but the heading is wrong by"),
    "odometry's frame taken for the map's": ("fixed @ odom_then.inverse() @ odom_now", "odom_now @ odom_then.inverse() @ fixed", "the robot moved differently: first compute its motion"),
    "far tags accepted": ("distance_m < FAR_M or jump_m < JUMP_M", "True", "3.1 m away that makes the robot jump by 0.50 m"),
    "both demanded": ("distance_m < FAR_M or jump_m < JUMP_M", "distance_m < FAR_M and jump_m < JUMP_M", "2.9 m away that makes the robot jump by 5.00 m"),
    "weights changed over": ("P @ np.linalg.inv(P + R)", "R @ np.linalg.inv(P + R)", "the position moves in the wrong direction, or too far: which"),
    "heading not wrapped": ("apart[2] = wrapped(apart[2])", "pass", "rad are neighbours"),
    "covariance left": ("return x, P - K @ P", "return x, P", "the covariance after the update is wrong: it combines both"),
}
