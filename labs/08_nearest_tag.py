# %% [markdown]
# # Lab 8: the nearest tag compared with a Kalman filter
# Where is the robot, if it observes tags of a known map? The first method is that of the exercise "Marker Based Visual Loc" of the Robotics Academy: the nearest tag
# determines the pose, and odometry continues from there. The second weighs both by their uncertainties (Kalman, "A New Approach to Linear Filtering and Prediction
# Problems", 1960). You write both and run them on the same lap. 60 minutes.

# %%
import numpy as np

from waymark import config, geometry, labs, pose, recording, samples

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
print(sum(kind == "tags" for kind, _ in events), "images")

# %% [markdown]
# ## 1. The nearest tag
# `seen` contains pairs of a tag's name and its pose in the camera frame. Which is nearest to the camera? None, if there are no tags.

# %%
def nearest(seen):
    """list of (name, geometry.SE3) -> one of them, or None"""
    raise NotImplementedError

# %% [markdown]
# ## 2. The pose of the robot
# The map contains `tag_map[name].map_T_tag`, the robot file `robot.base_T_cam`. Return x, y and heading of the robot.
# <details><summary>Hint</summary>map_T_tag tag_T_cam cam_T_base, and the heading of a matrix is atan2 of the first column.</details>

# %%
def fix(name, cam_T_tag):
    """-> geometry.SE2, map_T_base"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Between two images
# The odometry was `odom_then` at the last fix, and is `odom_now` now. Odometry has its own frame.

# %%
def carried(fixed, odom_then, odom_now):
    """three geometry.SE2 -> geometry.SE2, map_T_base now"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Accept or reject a fix
# Always accept a tag nearer than FAR_M. Reject a farther one if its fix is JUMP_M or more from the pose predicted by odometry.
#
# **Question:** a robot is lifted and put down elsewhere. How does this rule behave?

# %%
def accepted(distance_m, jump_m):
    """-> bool"""
    raise NotImplementedError

# %% [markdown]
# ## 5. Weighted update
# Prediction `x` with covariance `P`, fix `z` with covariance `R`, all of (x, y, heading). Return the updated x and P. Headings are angles on a circle.
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
lab = labs.check(8, globals())

# %% [markdown]
# ## Figure
# The figure shows the errors of both on the lap (`waymark.labs.loops` runs them with your functions). Then compare with Waymark's own localization on the
# whole lap: `waymark.localization.localize_recording(recording, map, method=…)` with the methods "anchor", "ekf" and "riekf", scored by `waymark.evaluation.score_trajectory`. The solution of the Academy's exercise that does the same with images is `waymark.academy.nearest_tag`.
# %%
if lab.points == 10:
    from waymark.labs import loops

    _errors = {"nearest_tag": loops.nearest_tag_errors(lab.answers), "filter": loops.filter_errors(lab.answers)}
    print("twenty seconds of the lap, root mean square:", ", ".join(f"{name.replace('_', ' ')} {np.sqrt(np.mean(e**2)):.3f} m" for name, e in _errors.items()))
    labs.figure("error of the position", "truth sample", "[m]", **{name: list(enumerate(e)) for name, e in _errors.items()})
