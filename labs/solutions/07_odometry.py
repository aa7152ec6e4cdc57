import numpy as np


def step(left_m, right_m, track_m):
    return geometry.SE2.exp([(left_m + right_m) / 2, 0, (right_m - left_m) / track_m])


def trajectory(wheels, radius_m, track_m):
    poses = [geometry.SE2()]
    for left, right in np.diff(wheels, axis=0) * radius_m:
        poses.append(poses[-1] @ step(left, right, track_m))
    return poses


def gyro_bias(wheels, rates):
    still = (np.diff(wheels, axis=0) == 0).all(axis=1)
    return rates[1:][still].mean()


def scales(measured, true):
    m, t = (np.array([motion.log() for motion in motions]) for motions in (measured, true))
    return tuple((m[:, i] @ t[:, i]) / (m[:, i] @ m[:, i]) for i in (0, 2))


WRONG = {
    "turned the other way": ("(right_m - left_m) / track_m", "(left_m - right_m) / track_m", "it turns in the wrong direction"),
    "half the track": ("(right_m - left_m) / track_m", "(right_m - left_m) / (track_m / 2)", "m turn a robot less than it returns"),
    "straight with the heading at the beginning": ("geometry.SE2.exp([(left_m + right_m) / 2, 0, (right_m - left_m) / track_m])", "geometry.SE2((left_m + right_m) / 2, 0, (right_m - left_m) / track_m)", "m, it drives straight ahead and turns afterwards, but a robot"),
    "steps in the frame of the first pose": ("poses[-1] @ step(left, right, track_m)", "step(left, right, track_m) @ poses[-1]", "is wrong: in whose frame is a step?"),
    "radius forgotten": ("np.diff(wheels, axis=0) * radius_m", "np.diff(wheels, axis=0)", "is wrong: how far did the wheels roll since the previous"),
    "angles taken for steps": ("np.diff(wheels, axis=0) * radius_m:", "wheels[1:] * radius_m:", "is wrong: how far did the wheels roll since the previous"),
    "moving samples averaged too": ("rates[1:][still].mean()", "rates.mean()", "samples in which the robot drives are averaged too"),
    "one wheel at rest is enough": ("== 0).all(axis=1)", "== 0).any(axis=1)", "a robot that turns about a wheel is not at rest"),
    "upside down": ("(m[:, i] @ t[:, i]) / (m[:, i] @ m[:, i])", "(m[:, i] @ m[:, i]) / (m[:, i] @ t[:, i])", "the scale of the distances is inverted"),
    "mean of ratios": ("(m[:, i] @ t[:, i]) / (m[:, i] @ m[:, i])", "np.mean(t[:, i] / m[:, i])", "of the distances the sum of squares is not minimal"),
    "the part across for the turn": ("for i in (0, 2)", "for i in (0, 1)", "of the turns the sum of squares is not minimal"),
}
