#!/usr/bin/python3
"""Cameras of the Linux driver vivid and gamepads created through uinput, in a virtual machine (machine.py).

usage: devices_test.py PROGRAM FOLDER [TestClass.test]"""
import json
import pathlib
import shlex
import shutil
import subprocess
import sys

import lap_player
import machine

MAX_S = 900
MAX_PX = 0.02  # between the corners of a rendered image and of the same image through the driver
MIN_SAME = 0.99
MAX_RMSE_M = 0.15  # images are 0.06 to 0.12 s late in the driver's queues, which is not measured; the rendered lap itself has 29 mm
IMAGES_HZ = 60  # of a lap played at half its speed, to a camera with at most this rate


def tag_frames(program: pathlib.Path, path: pathlib.Path) -> list:
    sys.path.insert(0, str(program.parents[1] / "python"))
    import waymark.recording

    return [sample for sample in waymark.recording.Recording(path).samples() if type(sample).__name__ == "TagFrame" and sample.detections]


def same_image(frame, rendered: list):
    """The stamp [ns] of the rendered image whose corners agree within MAX_PX, or None."""
    corners = {seen.tag: seen.corners_px for seen in frame.detections}
    for other in rendered:
        theirs = {seen.tag: seen.corners_px for seen in other.detections}
        if theirs.keys() == corners.keys() and all(abs(theirs[tag] - corners[tag]).max() < MAX_PX for tag in corners):
            return other.stamp_ns
    return None


def judge_lap(program: pathlib.Path, folder: pathlib.Path) -> int:
    """Checks the lap taught through the driver (its tags are those of the rendered images, in order) and its map."""
    taught = tag_frames(program, folder / "out/lap.mcap")
    rendered = tag_frames(program, folder / "lap/rendered.mcap")
    stamps = [same_image(frame, rendered) for frame in taught]
    found = [stamp for stamp in stamps if stamp is not None]
    back = sum(b < a for a, b in zip(found, found[1:]))
    print(f"taught through vivid: {len(found)} of {len(taught)} images with tags are rendered ones to {MAX_PX} px, {back} out of order")
    shutil.rmtree(folder / "map", ignore_errors=True)
    subprocess.run([program, "map", folder / "out/lap.mcap", "-o", folder / "map"], check=True)
    summary = json.loads((folder / "map/summary.json").read_text())
    print(f"map: {summary['tags']} tags from {summary['frames']} images, RMSE {1e3 * summary['tag_rmse_m']:.0f} mm, trajectory "
          f"{1e3 * summary['trajectory_rmse_m']:.0f} mm")
    if len(found) >= MIN_SAME * len(taught) and back == 0 and summary["tags"] == 8 and summary["tag_rmse_m"] < MAX_RMSE_M:
        return 0
    print(f"devices_test.py: expected {MIN_SAME:.0%} of the images in order, and 8 tags within {MAX_RMSE_M} m", file=sys.stderr)
    return 1


def main() -> int:
    program, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    if packages := machine.missing():
        print(f"devices_test.py: not installed: {' '.join(packages)}", file=sys.stderr)
        return 1
    sources = pathlib.Path(__file__).resolve().parents[2]
    lap = folder / "lap"
    lap.mkdir(parents=True, exist_ok=True)
    lap_player.record(str(program), lap, IMAGES_HZ)
    guest = shlex.join(["/usr/bin/python3", str(sources / "tests/devices/guest_test.py"), str(program), str(sources), str(lap), *sys.argv[3:]])
    code, output = machine.boot(folder, guest, MAX_S)
    print(output[output.find("machine: started"):])
    if code is None:
        print(f"devices_test.py: the machine did not end within {MAX_S} s", file=sys.stderr)
    if code != 0:
        return 1
    return judge_lap(program, folder) if (folder / "out/lap.mcap").exists() else 0


if __name__ == "__main__":
    sys.exit(main())
