"""The exercise "Marker Based Visual Loc" from JdeRobot's Robotics Academy, on Waymark's simulator and with a numeric score.

    python3 -m waymark.academy solution.py

runs a student's file unchanged. The file imports HAL, WebGUI and Frequency as in the Academy, and reads the tag poses from
/resources/exercises/marker_visual_loc/apriltags_poses.yaml. It may use pyapriltags (replaced by Waymark's detector if it is not
installed) and cv2 (Debian: python3-opencv). Simulated time advances by one image whenever the file reads the same sensor again.
The score therefore does not depend on the speed of the computer: the same file and seed give the same score.
"""

from .run import run_file  # noqa: F401
from .score import ScoredImage, score  # noqa: F401
