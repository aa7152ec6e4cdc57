#!/usr/bin/python3
"""Memory of a localisation over DDS at ten times the usual rates: odometry at 500 Hz, the IMU at 1000 Hz, tf at 500 Hz, of a peer on Cyclone
DDS. Samples the resident memory of each process once a second and fits a line after the first quarter. Exit code 1: it grows by more than
1 MB per hour and by more than three standard deviations of the slope.

usage: memory.py PROGRAM PEER [SECONDS]
"""
import pathlib
import subprocess
import sys
import tempfile
import time

from wire_peer import environment

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from claim import domain
from made import MAP_OF_SQUARE, made

MOST_MB_H = 1


def family(pid):
    children = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False).stdout.split()
    return [pid] + [one for child in children for one in family(int(child))]


def resident_mb(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return 0.0


def slope(points):
    """Slope of the least-squares line through (time, value), and its standard deviation."""
    count = len(points)
    middle = [sum(point[i] for point in points) / count for i in (0, 1)]
    spread = sum((t - middle[0]) ** 2 for t, _ in points)
    rise = sum((t - middle[0]) * (v - middle[1]) for t, v in points) / spread
    off = sum((v - middle[1] - rise * (t - middle[0])) ** 2 for t, v in points)
    return rise, (off / max(1, count - 2) / spread) ** 0.5


def main():
    program, peer = sys.argv[1:3]
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 1200
    with tempfile.TemporaryDirectory() as name:
        profile = pathlib.Path(name) / "robot.yaml"
        profile.write_text("robot: limo\nimu_topic: /imu\nsimulated: true\n", encoding="utf-8")
        there = environment(domain())
        robot = subprocess.Popen([peer, "flood", str(seconds + 30)], env=there)
        run = subprocess.Popen([program, "localize", "--robot", f"ros2:{profile}", "--map", str(made(program, *MAP_OF_SQUARE) / "map"), "--publish-ros2",
                                "--duration-s", str(seconds + 20), "--every-s", "60"], env=there)
        time.sleep(5)
        began, seen = time.monotonic(), {pid: [] for pid in family(run.pid)}
        while time.monotonic() - began < seconds:
            for pid, points in seen.items():
                points.append((time.monotonic() - began, resident_mb(pid)))
            time.sleep(1)
        names = {pid: pathlib.Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8").replace("\0", " ")[:60] for pid in seen}
        for process in (run, robot):
            process.terminate()
            process.wait(30)
    grows = False
    for pid, points in seen.items():
        rise, deviation = slope([point for point in points if point[0] > seconds / 4])
        print(f"{names[pid]}: {points[0][1]:.1f} MB at the begin, {points[-1][1]:.1f} MB at the end; {3600 * rise:+.2f} +- {3600 * deviation:.2f} MB/h")
        grows = grows or (3600 * rise > MOST_MB_H and rise > 3 * deviation)
    sys.exit(1 if grows else 0)


if __name__ == "__main__":
    main()
