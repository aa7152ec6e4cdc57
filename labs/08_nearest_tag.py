# %% [markdown]
# # Lab 8: the nearest tag against a Kalman filter
# Where is the robot, if it sees tags of a known map? The first answer is that of the exercise "Marker Based Visual Loc" of the Robotics Academy: the nearest tag
# says it, and odometry carries on from there. The second weighs both by how well they are known (Kalman, "A New Approach to Linear Filtering and Prediction
# Problems", 1960). You write both and let them drive the same lap. 60 minutes.

# %%
import numpy as np

from waymark import config, geometry, labs, pose, recording, samples

lab = labs.Lab("Lab 8")
robot, tag_map = config.read_robot("limo"), config.read_map(labs.data("samples/map/map.yaml"))
FAR_M, JUMP_M = 3.0, 0.4
events = []  # in order of time: ("odometry", geometry.SE2), ("tags", [(name, cam_T_tag), ...]), ("truth", geometry.SE2)
for sample in recording.Recording(labs.data("samples/lap.mcap")).samples(to_ns=20_000_000_000):
    if isinstance(sample, samples.Odometry):
        events.append(("odometry", sample.odom_T_base))
    elif isinstance(sample, samples.TagFrame):
        events.append(("tags", [(d.tag, pose.estimate_tag_pose(d, 0.16, robot.camera).best.cam_T_tag) for d in sample.detections if d.tag in tag_map]))
    elif isinstance(sample, samples.TruthPose):
        T = sample.map_T_base.matrix()
        events.append(("truth", geometry.SE2(T[0, 3], T[1, 3], np.arctan2(T[1, 0], T[0, 0]))))
print(sum(kind == "tags" for kind, _ in events), "pictures")

# %% [markdown]
# ## 1. The nearest tag
# `seen` holds pairs of a tag's name and its pose in the camera frame. Which is nearest to the camera? None, if none is seen.

# %%
def nearest(seen):
    """list of (name, geometry.SE3) -> one of them, or None"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Where must the robot be?
# The map says `tag_map[name].map_T_tag`, the robot's file `robot.base_T_cam`. Give x, y and heading of the robot.
# <details><summary>Hint</summary>map_T_tag tag_T_cam cam_T_base, and the heading of a matrix is atan2 of the first column.</details>

# %%
def fix(name, cam_T_tag):
    """-> geometry.SE2, map_T_base"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Between two pictures
# When the last fix was taken odometry said `odom_then`, now it says `odom_now`. Odometry has a frame of its own.

# %%
def carried(fixed, odom_then, odom_now):
    """three geometry.SE2 -> geometry.SE2, map_T_base now"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Is the fix to be believed?
# A tag that is nearer than FAR_M always is. One beyond must not say that the robot is JUMP_M or farther from where odometry carried it.
#
# **Question:** a robot is lifted and set down elsewhere. What becomes of this rule?

# %%
def accepted(distance_m, jump_m):
    """-> bool"""
    raise NotImplementedError

# %% [markdown]
# ## 5. Weigh them
# Prediction `x` with covariance `P`, fix `z` with covariance `R`, all of (x, y, heading). Give the updated x and P. Headings live on a circle.
# <details><summary>Hint</summary>K = P (P + R)^-1. The difference z - x has a heading of at most pi, and so has the result.</details>
#
# **Question:** what does the nearest tag alone correspond to, in terms of P and R?

# %%
def update(x, P, z, R):
    """(3,), (3, 3), (3,), (3, 3) -> (3,), (3, 3)"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_random = np.random.default_rng(8)


def _some(n):
    return [(f"tag36h11:{k}", geometry.SE3(geometry.SO3.from_rpy(*_random.normal(size=3)), _random.uniform(-1, 1, 3) + [0, 0, 2])) for k in range(n)]


def _nearest():
    for n in (1, 2, 5, 9):
        seen = _some(n)
        found = labs.several(nearest(seen), 2)
        if found[0] != min(seen, key=lambda s: np.linalg.norm(s[1].translation))[0]:
            return "a nearer one was seen: the distance has three coordinates"
    if nearest([]) is not None:
        return "nothing is seen: None"


def _flat(T):
    T = T.matrix()
    return geometry.SE2(T[0, 3], T[1, 3], np.arctan2(T[1, 0], T[0, 0]))


def _apart(a, b):
    return np.hypot(a.x - b.x, a.y - b.y), abs(np.remainder(a.yaw - b.yaw + np.pi, 2 * np.pi) - np.pi)


def _fix():
    for name in list(tag_map)[:6]:
        there = geometry.SE2(*_random.uniform(-1, 1, 3))
        cam_T_tag = (there.lift() @ robot.base_T_cam).inverse() @ tag_map[name].map_T_tag
        metres, radians = _apart(labs.instance(fix(name, cam_T_tag), geometry.SE2), there)
        if metres > 1e-6:
            off = np.linalg.norm(robot.base_T_cam.translation[:2])
            return "that is where the camera is, not the robot" if abs(metres - off) < 1e-6 else f"{metres:.2f} m from where the robot is: write the frames in a row"
        if radians > 1e-6:
            return f"the place is right, the heading off by {np.degrees(radians):.0f} degrees"


def _carried():
    for _ in range(5):
        fixed, then, moved = (geometry.SE2(*_random.uniform(-2, 2, 3)) for _ in range(3))
        metres, radians = _apart(labs.instance(carried(fixed, then, then @ moved), geometry.SE2), fixed @ moved)
        if metres > 1e-9 or radians > 1e-9:
            return "first how the robot moved since, in its own frame; then from the fix on"


def _accepted():
    for distance, jump, right in ((0.5, 0.1, True), (2.9, 5.0, True), (3.1, 0.3, True), (3.1, 0.5, False), (9.0, 0.41, False), (9.0, 0.0, True)):
        if labs.truth(accepted(distance, jump)) != right:
            return f"a tag {distance} m away that makes the robot jump by {jump} m is {'' if right else 'not '}accepted"


def _update():
    P, R = np.diag([0.04, 0.01, 0.02]), np.diag([0.01, 0.03, 0.02])
    P[0, 1] = P[1, 0] = 0.01
    for x, z in (([1, 2, 0.1], [1.2, 1.9, 0.2]), ([0, 0, 3.1], [0, 0, -3.1])):
        x, z = np.array(x, float), np.array(z, float)
        found, left = labs.several(update(x.copy(), P.copy(), z, R), 2)
        found, left = labs.numbers(found, (3,)), labs.numbers(left, (3, 3))
        K = P @ np.linalg.inv(P + R)
        apart = z - x
        apart[2] = np.remainder(apart[2] + np.pi, 2 * np.pi) - np.pi
        right = x + K @ apart
        if not np.allclose(found[:2], right[:2], atol=1e-9):
            return "the position is drawn to the wrong side, or too much"
        if abs(np.remainder(found[2] - right[2] + np.pi, 2 * np.pi) - np.pi) > 1e-9:
            return "headings of 3.1 and -3.1 rad are neighbours"
        if abs(found[2]) > np.pi + 1e-9:
            return f"a heading of {found[2]:.2f} rad: bring it back to the circle"
        if not np.allclose(left, P - K @ P, atol=1e-9):
            return "the covariance after an update is smaller than before, in both"


def _drive_nearest():
    """The squared errors [m²] along the lap, and their times."""
    fixed = then = now = None
    errors = []
    for kind, value in events:
        if kind == "odometry":
            now = value
        elif kind == "tags" and now is not None and (best := nearest(value)) is not None:
            at = fix(*best)
            jump = 0 if fixed is None else _apart(at, carried(fixed, then, now))[0]
            if accepted(np.linalg.norm(best[1].translation), jump):
                fixed, then = at, now
        elif kind == "truth" and fixed is not None:
            errors.append(_apart(carried(fixed, then, now), value)[0])
    return np.array(errors)


def _drive_filter():
    x = P = last = None
    errors = []
    for kind, value in events:
        if kind == "odometry":
            if x is not None:
                moved, turn = last.inverse() @ value, np.array([[np.cos(x[2]), -np.sin(x[2])], [np.sin(x[2]), np.cos(x[2])]])
                go = turn @ [moved.x, moved.y]
                F = np.eye(3)
                F[:2, 2] = [-go[1], go[0]]
                x = x + [*go, moved.yaw]
                P = F @ P @ F.T + np.diag([1e-4, 1e-4, 1e-4]) * np.hypot(*go) + 1e-9 * np.eye(3)
            last = value
        elif kind == "tags" and last is not None:
            for name, cam_T_tag in value:
                at, away = fix(name, cam_T_tag), np.linalg.norm(cam_T_tag.translation)
                z, R = np.array([at.x, at.y, at.yaw]), np.diag([0.02, 0.02, 0.02]) ** 2 * away**4
                x, P = (z, R) if x is None else update(x, P, z, R)
        elif kind == "truth" and x is not None:
            errors.append(np.hypot(x[0] - value.x, x[1] - value.y))
    return np.array(errors)


def _rms(errors):
    return np.sqrt(np.mean(np.square(errors)))


lab.check("the nearest tag", 1, _nearest)
lab.check("where the robot is", 3, _fix)
lab.check("between pictures", 2, _carried)
lab.check("which fix to believe", 1, _accepted)
lab.check("the weights", 3, _update)
if lab.points == 10:
    print(f"      twenty seconds of the lap: nearest tag {_rms(_drive_nearest()):.3f} m, your filter {_rms(_drive_filter()):.3f} m (root mean square)")
lab.finish()

# %% [markdown]
# ## Figure
# The errors of both. Then compare with Waymark's own on the whole lap: `waymark.localization.localize_recording(recording, map, method=…)` with the methods "anchor", "ekf" and
# "riekf", judged by `waymark.evaluation.score_trajectory`. The solution of the Academy's exercise that does the same by pictures is the file of `waymark.academy.nearest_tag`.
# %%
if lab.points == 10:
    labs.figure("error of the position", "truth sample", "[m]", nearest_tag=list(enumerate(_drive_nearest())), filter=list(enumerate(_drive_filter())))
