#!/usr/bin/python3
"""Waymark recordings opened by `@mcap/core` and `@foxglove/rosmsg2-serialization`, message by message.

usage: recording_test.py PROGRAM ALL_TYPES NPM_FOLDER     ALL_TYPES writes a file with every type of message
Exit code 77 (skipped) when tools/install_validators.sh has not been run.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from made import DEMO, made  # noqa: E402

SKIPPED = 77
TYPES = {"apriltag_msgs/msg/AprilTagDetectionArray", "waymark_msgs/msg/TagCornerCovariances", "sensor_msgs/msg/CameraInfo",
         "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState", "nav_msgs/msg/Odometry", "geometry_msgs/msg/TwistStamped",
         "geometry_msgs/msg/PoseStamped", "tf2_msgs/msg/TFMessage"}
REPLAY_TYPES = TYPES | {"geometry_msgs/msg/PoseWithCovarianceStamped", "diagnostic_msgs/msg/DiagnosticArray"}

ALL_TYPES = REPLAY_TYPES | {
    "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/Joy",
    "nav_msgs/msg/Path", "geometry_msgs/msg/Twist", "visualization_msgs/msg/MarkerArray", "diagnostic_msgs/msg/DiagnosticArray",
    "waymark_msgs/msg/RangeBearing", "waymark_msgs/msg/TagPoseArray", "waymark_msgs/msg/UnreliableTags"}


def main():
    program, all_types, npm = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    modules = npm / "node_modules"
    if not (modules / ".bin/node").exists() or not (modules / "@mcap/core").exists():
        print(f"no validators in {modules}: tools/install_validators.sh installs them")
        return SKIPPED

    def validate(path):
        script = pathlib.Path(__file__).with_name("validate_recording.mjs")
        return subprocess.run([modules / ".bin/node", script, path], capture_output=True, text=True, check=False,
                              env={**os.environ, "WAYMARK_NODE_MODULES": str(modules)})

    with tempfile.TemporaryDirectory(prefix="waymark-npm-") as folder:
        shutil.copytree(made(program, *DEMO) / "demo", folder, dirs_exist_ok=True)
        subprocess.run([all_types, f"{folder}/all.mcap"], check=True)
        for name, types in (("lap.mcap", TYPES), ("replay.mcap", REPLAY_TYPES), ("all.mcap", ALL_TYPES)):
            path = f"{folder}/{name}"
            done = validate(path)
            assert done.returncode == 0, done.stderr
            seen = json.loads(done.stdout)
            ours = json.loads(subprocess.run([program, "info", "--json", path], check=True, capture_output=True).stdout)
            assert set(seen["types"]) == types, set(seen["types"]) ^ types
            for type_name, count in seen["types"].items():
                assert count == sum(t["messages"] for t in ours["topics"] if t["type"] == type_name), type_name
            assert seen["metadata"] == ours["metadata"]
            assert seen["attachments"] == {a["name"]: a["size_bytes"] for a in ours["attachments"]}
            assert seen["records"]["ChunkIndex"] == ours["chunks"]
            print(f"{name}: {sum(seen['types'].values())} messages of {len(types)} types")
        # The validator detects damage: one byte is changed in the middle of a chunk.
        damaged = pathlib.Path(folder) / "lap.mcap"
        data = bytearray(damaged.read_bytes())
        data[len(data) // 2] ^= 0xFF
        damaged.write_bytes(data)
        assert validate(damaged).returncode == 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
