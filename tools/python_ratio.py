#!/usr/bin/python3
"""Time of detector and filter through Python relative to C++, on rendered images of 1280 x 720 with tags; of the filter also over a recording.

usage: tools/python_ratio.py PEER [RUNS]     PEER: the program waymark_python_peer; PYTHONPATH contains the package of the same build
"""
import pathlib
import subprocess
import sys
import tempfile
import time

from waymark import camera, config, image, localization, samples, simulation, tags

FRAMES = 40
RECORDED = 2000  # frames of the recording
SHARE = pathlib.Path(__file__).resolve().parent.parent / "share"


def robot_720p(folder):
    """The robot with a camera of 1280 x 720, and its file."""
    robot = config.read_robot("limo")
    robot.camera = camera.pinhole(1280, 720, 950, 950, 640.5, 360.5)
    path = folder / "robot.yaml"
    path.write_text(robot.to_yaml())
    return config.read_robot(str(path)), path


def python_times(image, world, robot):
    detector, localizer = tags.Detector(), localization.Localizer(world.tags, robot)
    detector_s = filter_s = 0.0
    for i in range(FRAMES):
        begin = time.process_time()
        found = detector.detect(image, robot.camera)
        seen = time.process_time()
        for k in range(3):
            localizer.add(samples.Odometry(stamp_ns=(60 * i + 20 * k) * 1_000_000))
        localizer.add(samples.TagFrame(stamp_ns=(60 * i + 40) * 1_000_000, detections=found))
        localizer.estimate()
        done = time.process_time()
        if i >= 3:
            detector_s += seen - begin
            filter_s += done - seen
    return detector_s / (FRAMES - 3), filter_s / (FRAMES - 3)


def recording_time(image, world, robot):
    """Seconds per frame of the filter over all samples in one call."""
    found = tags.Detector().detect(image, robot.camera)
    recorded = []
    for i in range(RECORDED):
        recorded += [samples.Odometry(stamp_ns=(60 * i + 20 * k) * 1_000_000) for k in range(3)]
        recorded.append(samples.TagFrame(stamp_ns=(60 * i + 40) * 1_000_000, detections=found))
    begin = time.process_time()
    localization.localize(recorded, world.tags, robot)
    return (time.process_time() - begin) / RECORDED


def main():
    peer, runs = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 7
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        robot, robot_file = robot_720p(folder)
        world = config.read_world("circuit24")
        simulator = simulation.Simulator(world, robot, images=True)
        photo = next(s for s in iter(simulator.next, None) if isinstance(s, samples.CameraFrame)).image
        image.write(str(folder / "image.png"), photo)
        python, cpp = [], []
        for _ in range(runs):  # alternating, so that other load affects both
            python.append((*python_times(photo, world, robot), recording_time(photo, world, robot)))
            done = subprocess.run([peer, folder / "image.png", SHARE / "worlds" / "circuit24.yaml", robot_file, str(FRAMES), str(RECORDED)], check=True, capture_output=True,
                                  text=True)
            cpp.append(tuple(float(word) for word in done.stdout.split()))
    for row, name in enumerate(("detector", "filter after an image", "filter over a recording")):
        ours, theirs = min(run[row] for run in python), min(run[row] for run in cpp)
        print(f"{name}: {ours * 1e3:.4f} ms through Python, {theirs * 1e3:.4f} ms in C++, ratio {ours / theirs:.3f}")
    ours, theirs = (min(sum(run[:2]) for run in runs) for runs in (python, cpp))
    print(f"both, a frame: {ours * 1e3:.4f} ms through Python, {theirs * 1e3:.4f} ms in C++, ratio {ours / theirs:.3f}")


if __name__ == "__main__":
    main()
