#!/usr/bin/python3
"""Time from the exposure of an image to the resulting command: images of 640 x 480 at 30 Hz of a peer on Cyclone DDS, over the network, through the robot
process, the watchdog and the detector, until the next decision; all times are those of the robot's clock, from the recording.

Other programs on the computer increase the result: `chrt -r 1 latency.py …` has priority over them.

usage: latency.py PROGRAM PEER [SECONDS [FLAG ...]]: flags of `waymark run`, for example --detector waymark
"""
import pathlib
import struct
import subprocess
import sys
import tempfile
import time

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / folder) for folder in ("plant", "support")]
import mcap_poses  # noqa: E402
from claim import domain  # noqa: E402
from wire_peer import environment  # noqa: E402


def latencies_ms(file):
    data = file.read_bytes()
    topics, exposed, found = {}, None, []
    for kind, content in mcap_poses.records(data[len(mcap_poses.MAGIC):-len(mcap_poses.MAGIC)]):
        if kind == mcap_poses.OP_CHANNEL:
            number, name = mcap_poses.channel_topic(content)
            topics[number] = name
        if kind != mcap_poses.OP_MESSAGE:
            continue
        seconds, nanoseconds = struct.unpack_from("<iI", content, 22 + 4)  # of the header, after the encapsulation
        stamp = seconds * 1_000_000_000 + nanoseconds
        topic = topics[struct.unpack_from("<H", content)[0]]
        if topic == "/tag_detections":
            exposed = stamp
        elif topic == "/cmd_vel" and exposed is not None:
            found.append((stamp - exposed) / 1e6)
            exposed = None
    return sorted(found)


def main():
    program, peer = sys.argv[1:3]
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 20
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "robot.yaml").write_text("robot: limo\nimage_topic: /camera/color/image_raw\n")
        there = environment(domain())
        robot = subprocess.Popen([peer, "latency", str(seconds)], env=there, stdout=subprocess.DEVNULL)
        run = subprocess.Popen([program, "run", "--robot", f"ros2:{folder / 'robot.yaml'}", "--driver", "lines", "--anchor", "0",
                                "--tag-size-m", "0.16", *sys.argv[4:], "-o", str(folder / "session")], env=there, stdin=subprocess.PIPE, text=True)
        time.sleep(4)
        run.stdin.write("go\n")
        run.stdin.flush()
        time.sleep(seconds - 6)
        run.stdin.close()
        run.wait(60)
        robot.wait(60)
        found = latencies_ms(folder / "session" / "lap.mcap")
    if not found:
        sys.exit("no image became a command")
    print(f"{len(found)} images in {seconds - 6:.0f} s; exposure to command: median {found[len(found) // 2]:.1f} ms, "
          f"p90 {found[len(found) * 9 // 10]:.1f} ms, p99 {found[len(found) * 99 // 100]:.1f} ms, worst {found[-1]:.1f} ms")


if __name__ == "__main__":
    main()
