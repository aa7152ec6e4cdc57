"""The nominal robot and its robot file for Waymark. The plants contain the true parameters."""
import dataclasses
import math
import textwrap

import numpy as np

import frames

WHEEL_RADIUS_M = 0.045
TRACK_M = 0.172
WHEELBASE_M = 0.2
WIDTH_PX, HEIGHT_PX = 640, 480


@dataclasses.dataclass(frozen=True)
class Camera:
    """Pinhole with radial distortion; pixel centres at integers."""
    fx_px: float = 431.0
    fy_px: float = 432.5
    cx_px: float = 317.4
    cy_px: float = 243.1
    k1: float = -0.16
    k2: float = 0.045
    x_m: float = 0.084
    y_m: float = 0.0
    z_m: float = 0.18
    roll_rad: float = 0.0
    pitch_rad: float = 0.0  # positive tilts down
    yaw_rad: float = 0.0

    def base_T_camera(self) -> np.ndarray:
        """The camera looks along its z, x right, y down."""
        looks = frames.roll_pitch_yaw(self.roll_rad, self.pitch_rad, self.yaw_rad)
        optical = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
        return frames.rigid(looks @ optical, (self.x_m, self.y_m, self.z_m))

    def project(self, camera_p: np.ndarray) -> np.ndarray:
        """Projects points in front of the camera (n, 3) to pixels."""
        x, y = camera_p[..., 0] / camera_p[..., 2], camera_p[..., 1] / camera_p[..., 2]
        square = x * x + y * y
        stretch = 1 + square * (self.k1 + square * self.k2)
        return np.stack([self.fx_px * x * stretch + self.cx_px, self.fy_px * y * stretch + self.cy_px], axis=-1)

    def rays(self, u_px: np.ndarray, v_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Undistorted x / z and y / z of pixels, by fixed-point iteration."""
        xd, yd = (u_px - self.cx_px) / self.fx_px, (v_px - self.cy_px) / self.fy_px
        x, y = xd.copy(), yd.copy()
        for _ in range(30):
            square = x * x + y * y
            stretch = 1 + square * (self.k1 + square * self.k2)
            x, y = xd / stretch, yd / stretch
        return x, y


def camera_info_yaml(camera: Camera) -> str:
    """In the format of ROS camera_calibration."""
    c = camera
    return f"""image_width: {WIDTH_PX}
image_height: {HEIGHT_PX}
camera_name: plant
camera_matrix: {{rows: 3, cols: 3, data: [{c.fx_px}, 0.0, {c.cx_px}, 0.0, {c.fy_px}, {c.cy_px}, 0.0, 0.0, 1.0]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 4, data: [{c.k1}, {c.k2}, 0.0, 0.0]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]}}
projection_matrix: {{rows: 3, cols: 4, data: [{c.fx_px}, 0.0, {c.cx_px}, 0.0, 0.0, {c.fy_px}, {c.cy_px}, 0.0, 0.0, 0.0, 1.0, 0.0]}}
"""


def robot_yaml(camera: Camera) -> str:
    """The robot file for Waymark, with the assumed camera, which may differ from the true one."""
    c = camera
    return f"""name: plant
hull: {{front_m: 0.161, rear_m: 0.161, width_m: 0.22, height_m: 0.251}}
limits: {{speed_m_s: 1.0, yaw_rate_rad_s: 2.0, acceleration_m_s2: 2.0, yaw_acceleration_rad_s2: 8.0}}
wheels: {{radius_m: {WHEEL_RADIUS_M}, track_m: {TRACK_M}}}
camera_mounting: {{x_m: {c.x_m}, y_m: {c.y_m}, z_m: {c.z_m}, roll_deg: {math.degrees(c.roll_rad)}, pitch_deg: {math.degrees(c.pitch_rad)}, yaw_deg: {math.degrees(c.yaw_rad)}}}
camera_info:
""" + textwrap.indent(camera_info_yaml(c), "  ")
