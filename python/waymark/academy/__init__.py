"""The exercise "Marker Based Visual Loc" of JdeRobot's Robotics Academy on Waymark's simulator, with a numeric score.

    python3 -m waymark.academy solution.py

runs a student's file unchanged: it imports HAL, WebGUI and Frequency as there, reads the tags' poses from
/resources/exercises/marker_visual_loc/apriltags_poses.yaml, and may use pyapriltags (where that is not installed, Waymark's
detector replaces it) and cv2 (Debian: python3-opencv). Simulated time passes by one picture whenever the file asks the
same sensor again, so the score does not depend on how fast the computer is: the same file and seed give the same score.
"""

from .run import run_file  # noqa: F401
from .score import Picture, score  # noqa: F401
