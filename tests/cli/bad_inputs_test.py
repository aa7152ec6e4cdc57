#!/usr/bin/python3
"""Bad input for every verb and every entry point of Python. Each ends with exit code 1 (a file or a device) or 2 (a word of the
command line), names the cause and its place, and writes nothing. The texts are on tests/pages/bad_inputs.txt, one entry per input,
with numbers as printed.

usage: bad_inputs_test.py PROGRAM [--python] [unittest options]     --python: test the package on PYTHONPATH as well
"""
import ctypes
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

import harness
import images
import recordings
from laps import MAP_OF_SQUARE, made
import golden_page

WITH_PYTHON = "--python" in sys.argv
if WITH_PYTHON:
    sys.argv.remove("--python")

# The files of the tables below. (name, old, new) of EDITS: a copy of a valid file with one mistake.
FILES = {
    "text.mcap": "this is not a recording\n", "text.png": "this is not an image\n", "text.mp4": "this is not a video\n", "text.yaml": "hello\n",
    "open.yaml": "name: [1, 2\n", "list.yaml": "- 1\n- 2\n", "binary.yaml": b"\0\1\2\3" * 9, "latin1.yaml": "name: k\xfcche\n".encode("latin-1"),
    "options.yaml": "detector:\n  quad_decimat: 2\n", "faults.yaml": "faults:\n  - {fault: camera_frozn, at_s: 10}\n",
    "fault_late.yaml": "faults:\n  - {fault: camera_lost, at_s: -1}\n",
    "no_tags.yaml": "format: waymark-map-1\nanchor: \"tag36h11:0\"\ntags: []\n", "truth_no_id.csv": "image,family,x0,y0\na,b,1,2\n",
    "one_point.csv": "x_m,y_m\n0,0\n", "no_y.csv": "x_m,z_m\n0,0\n1,0\n", "word.csv": "x_m,y_m\n0,0\n1,one\n", "nan.csv": "x_m,y_m\n0,0\nnan,1\n",
    "twice.csv": "x_m,x_m,y_m\n0,0,0\n1,1,0\n2,2,0\n", "ragged.csv": "x_m,y_m\n0,0\n1\n", "odometry.csv": "stamp_s,x_m\n1,2\n",
    "three.tum": "0 0 0\n", "nan.tum": "0 nan 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n", "zero.tum": "0 0 0 0 0 0 0 0\n1 1 0 0 0 0 0 0\n",
    "late.tum": "".join(f"{t} {t} 0 0 0 0 0 1\n" for t in range(900, 905)), "early.tum": "".join(f"{t} {t} 0 0 0 0 0 1\n" for t in range(5)),
    "bad.sdf": "<sdf version='1.6'><world name='w'>", 
    "hello.json": '{"type": "hello", "protocol_version": 9}\n', "page.html": "<p>mine</p>\n",
    "bad.jsonl": "{\"image\": \n", "ros2.yaml": "robot: limo\ntopics:\n  odometri: /odom\n",
}
SHARE = pathlib.Path(__file__).resolve().parents[2] / "share"
EDITS = [
    ("camera.yaml", "camera_key.yaml", "image_width", "image_widht"), ("camera.yaml", "camera_type.yaml", "320", "wide"),
    ("camera.yaml", "camera_nan.yaml", "[300,", "[.nan,"), ("camera.yaml", "camera_negative.yaml", "[300,", "[-300,"),
    ("camera.yaml", "camera_huge.yaml", "320", "99999999"), ("camera.yaml", "camera_model.yaml", "plumb_bob", "fishy"),
    ("camera.yaml", "camera_few.yaml", "data: [0, 0, 0, 0, 0]", "data: [0, 0]"), ("camera.yaml", "camera_size.yaml", "320", "321"),
    ("robot.yaml", "robot_key.yaml", "speed_m_s", "sped_m_s"), ("robot.yaml", "robot_type.yaml", "radius_m: 0.045", "radius_m: small"),
    ("robot.yaml", "robot_nan.yaml", "radius_m: 0.045", "radius_m: .nan"), ("robot.yaml", "robot_negative.yaml", "track_m: 0.172", "track_m: -0.172"),
    ("robot.yaml", "robot_huge.yaml", "track_m: 0.172", "track_m: 172"), ("robot.yaml", "robot_tab.yaml", "limits:", "\tlimits:"),
    ("world.yaml", "world_key.yaml", "tag_size_m", "tag_size"), ("world.yaml", "world_family.yaml", "tagCustom48h12", "tag48h12"),
    ("world.yaml", "world_anchor.yaml", "anchor_id: 1", "anchor_id: 99"), ("world.yaml", "world_twice.yaml", "id: 2,", "id: 1,"),
    ("world.yaml", "world_nan.yaml", "x_m: 2.070", "x_m: .nan"), ("world.yaml", "world_size.yaml", "0.054", "54"),
    ("world.yaml", "world_robot.yaml", "robot: mbot", "robot: mbott"),
    ("map/map.yaml", "map_format.yaml", "waymark-map-1", "waymark-map-9"), ("map/map.yaml", "map_key.yaml", "size_m", "size"),
    ("map/map.yaml", "map_zero.yaml", "size_m: 0.054", "size_m: 0"), ("map/map.yaml", "map_tag.yaml", "tagCustom48h12:1\"", "tag36h12:1\""),
    ("map/map.yaml", "map_turn.yaml", "quaternion_xyzw: [", "quaternion_xyzw: [9, 9, 9, 9] # ["),
]

# Exit code | what the text names | words of the command line.
FILES_TABLE = """
1 | none.png | detect none.png
1 | cut.png | detect cut.png
1 | text.png | detect text.png
1 | empty.png | detect empty.png
1 | empty_folder | detect empty_folder
1 | lap.mcap | detect lap.mcap/0.png
1 | text.mp4 | detect text.mp4
1 | camera_key.yaml:1 | detect photograph.png --camera camera_key.yaml --tag-size-m 0.1
1 | camera_type.yaml:1 | detect photograph.png --camera camera_type.yaml --tag-size-m 0.1
1 | camera_nan.yaml:4 | detect photograph.png --camera camera_nan.yaml --tag-size-m 0.1
1 | camera_negative.yaml:4 | detect photograph.png --camera camera_negative.yaml --tag-size-m 0.1
1 | camera_huge.yaml:1 | detect photograph.png --camera camera_huge.yaml --tag-size-m 0.1
1 | camera_model.yaml:5 | detect photograph.png --camera camera_model.yaml --tag-size-m 0.1
1 | camera_few.yaml:6 | detect photograph.png --camera camera_few.yaml --tag-size-m 0.1
1 | 321x240 | detect photograph.png --camera camera_size.yaml --tag-size-m 0.1
1 | photograph.png | detect photograph.png --camera photograph.png --tag-size-m 0.1
1 | open.yaml | detect photograph.png --camera open.yaml --tag-size-m 0.1
1 | list.yaml | detect photograph.png --camera list.yaml --tag-size-m 0.1
1 | binary.yaml | detect photograph.png --camera binary.yaml --tag-size-m 0.1
1 | latin1.yaml | detect photograph.png --camera latin1.yaml --tag-size-m 0.1
1 | empty.yaml | detect photograph.png --camera empty.yaml --tag-size-m 0.1
1 | options.yaml:2 | detect photograph.png --config options.yaml
1 | list.yaml | detect photograph.png --config list.yaml
1 | none.mcap | info none.mcap
1 | empty.mcap | info empty.mcap
1 | text.mcap | info text.mcap
1 | empty_folder | info empty_folder
1 | photograph.png | info photograph.png
1 | camera.yaml | info camera.yaml
1 | no_y.csv | info no_y.csv
1 | cut.bag | info cut.bag
1 | cut.db3 | info cut.db3
1 | cut.csv.gz | info cut.csv.gz
1 | photograph.png | play photograph.png
1 | none.mcap | play none.mcap
2 | /nosuch | play lap.mcap --topics /nosuch --speed 0
1 | text.mcap | recover text.mcap
1 | photograph.png | recover photograph.png -o out.mcap
1 | byte | play cut.mcap --speed 0
1 | byte | map lap cut.mcap -o out
1 | byte | localize log cut.mcap --map map
1 | byte | calibrate robot cut.mcap -o out.yaml
1 | lap.mcap | recover cut.mcap -o lap.mcap
1 | photograph.png | convert photograph.png out.mcap
1 | lap.mcap | convert none.mcap lap.mcap
1 | truth.csv | convert lap.mcap truth.csv --kind odometry
1 | no_y.csv | convert no_y.csv out.mcap
1 | ragged.csv | convert ragged.csv out.mcap
1 | odometry.csv | convert odometry.csv out.mcap
2 | --kind | convert odometry.csv out.mcap --kind odometry
1 | no_camera.mcap | convert no_camera.mcap out.csv --kind detections
1 | locked | convert lap.mcap locked/out.mcap
1 | none/ | convert lap.mcap none/out.mcap
1 | lap.mcap | simulate --like no_camera.mcap -o lap.mcap
1 | photograph.png | simulate --like photograph.png -o out.mcap
1 | text.mcap | simulate --like text.mcap -o out.mcap
1 | photograph.png | view photograph.png
1 | empty_folder | view empty_folder
1 | text.mcap | view text.mcap
1 | photograph.png | report photograph.png
2 | photograph.png | report lap.mcap -o photograph.png
1 | page.html | report lap.mcap -o page.html
1 | empty_folder | report empty_folder
1 | photograph.png | plot photograph.png
1 | photograph.png | plot map --figure map -o photograph.png
1 | photograph.png | map lap photograph.png -o out
1 | text.mcap | map lap text.mcap -o out
1 | no_camera.mcap | map lap no_camera.mcap -o out --tag-size-m 0.1
1 | no_tags.mcap | map lap no_tags.mcap -o out --tag-size-m 0.1
1 | photograph.png | map lap lap.mcap -o photograph.png
1 | map_format.yaml | map lap lap.mcap -o out --prior map_format.yaml
1 | empty_folder | map lap lap.mcap -o out --extend empty_folder
1 | robot_key.yaml:5 | map lap lap.mcap -o out --robot robot_key.yaml
1 | text.mp4 | map video text.mp4 --camera camera.yaml --tag-size-m 0.1 -o out
1 | camera_nan.yaml | map video text.mp4 --camera camera_nan.yaml --tag-size-m 0.1 -o out
1 | empty_folder | map scene lap.mcap --tagslam empty_folder -o out
1 | text.yaml | map convert text.yaml out.yaml
1 | map_key.yaml | map convert map_key.yaml out.yaml
1 | map_zero.yaml | map convert map_zero.yaml out.yaml
1 | map_tag.yaml | map convert map_tag.yaml out.yaml
1 | map_turn.yaml | map convert map_turn.yaml out.yaml
1 | map_format.yaml | map convert map_format.yaml out.yaml
1 | lap.mcap | map convert lap.mcap out.yaml
1 | empty_folder | replay empty_folder --world world.yaml
1 | no_route | replay no_route --world world.yaml
1 | one_point | replay one_point --world world.yaml
1 | route_nan | replay route_nan --world world.yaml
1 | no_tags | replay no_tags --world world.yaml
1 | other_map | replay other_map --world world.yaml
1 | map.yaml | replay map/map.yaml --world world.yaml
1 | lap.mcap | replay lap.mcap --world world.yaml
1 | world_key.yaml | replay map --world world_key.yaml
1 | world_family.yaml | replay map --world world_family.yaml
1 | world_anchor.yaml | replay map --world world_anchor.yaml
1 | world_twice.yaml | replay map --world world_twice.yaml
1 | world_nan.yaml | replay map --world world_nan.yaml
1 | world_size.yaml:6 | teach --world world_size.yaml -o out.mcap
1 | mbott | teach --world world_robot.yaml -o out.mcap
1 | world.yaml | replay map --world world.yaml --calibration world.yaml
1 | faults.yaml:2 | replay map --world world.yaml --faults faults.yaml
1 | fault_late.yaml:2 | replay map --world world.yaml --faults fault_late.yaml
1 | lap.mcap | replay map --world world.yaml -o lap.mcap
1 | lap.mcap | teach --world world.yaml -o lap.mcap
1 | locked | teach --world world.yaml -o locked/out.mcap
1 | robot_key.yaml:5 | teach --world world.yaml --robot-file robot_key.yaml -o out.mcap
1 | robot_type.yaml:6 | teach --world world.yaml --robot-file robot_type.yaml -o out.mcap
1 | robot_nan.yaml:6 | teach --world world.yaml --robot-file robot_nan.yaml -o out.mcap
1 | robot_negative.yaml:6 | teach --world world.yaml --robot-file robot_negative.yaml -o out.mcap
1 | robot_huge.yaml:6 | teach --world world.yaml --robot-file robot_huge.yaml -o out.mcap
1 | robot_tab.yaml:5 | robots robot_tab.yaml
1 | empty.yaml | robots empty.yaml
1 | photograph.png | robots photograph.png
1 | empty_folder | routes empty_folder
1 | one_point | routes one_point
1 | photograph.png | routes photograph.png
1 | one_point | optimize one_point
1 | empty_folder | optimize empty_folder
1 | text.yaml | optimize map --weights text.yaml
1 | photograph.png | run --world world.yaml --driver scripted -o photograph.png
1 | photograph.png | demo -o photograph.png
1 | photos | samples photos
1 | no_tags.yaml | explore --map no_tags.yaml
1 | photograph.png | explore --map photograph.png
1 | photograph.png | localize log photograph.png --map map
1 | no_camera.mcap | localize log no_camera.mcap --map map
1 | no tag was detected | localize log no_tags.mcap --map map
1 | no_tags.yaml | localize log lap.mcap --map no_tags.yaml
1 | photograph.png | localize log lap.mcap --map photograph.png
1 | lap.mcap | localize log lap.mcap --map map -o lap.mcap
1 | tagCustom48h12 | localize log lap.mcap --map other_map
1 | text.mp4 | localize video text.mp4 --camera camera.yaml --map map
1 | none.tum | evaluate none.tum late.tum
1 | three.tum | evaluate three.tum late.tum
1 | nan.tum | evaluate nan.tum late.tum
1 | zero.tum | evaluate zero.tum late.tum
1 | 0.000 to 4.000 s | evaluate early.tum late.tum
1 | photograph.png | evaluate photograph.png late.tum
1 | 900.000 to 904.000 s | evaluate no_camera.mcap late.tum
1 | truth_no_id.csv | evaluate detections --truth truth_no_id.csv photograph.png
1 | bad.jsonl | evaluate detections --truth truth.csv --detections bad.jsonl
1 | 0 of 1 | calibrate camera photograph.png --cols 6 --rows 6 --tag-size-m 0.1 -o out.yaml
1 | empty_folder | calibrate camera empty_folder --cols 6 --rows 6 --tag-size-m 0.1 -o out.yaml
1 | text.mp4 | calibrate camera text.mp4 --cols 6 --rows 6 --tag-size-m 0.1 -o out.yaml
1 | world.yaml | calibrate camera photos --cols 6 --rows 6 --tag-size-m 0.1 -o world.yaml
1 | map_key.yaml:15 | calibrate camera photos --map map_key.yaml -o out.yaml
1 | empty_folder/map.yaml | calibrate camera photos --map empty_folder -o out.yaml
1 | photograph.png | calibrate robot photograph.png -o out.yaml
1 | no_tags.mcap | calibrate robot no_tags.mcap -o out.yaml
1 | one_point.csv | world new --path one_point.csv --tag-size-m 0.1 -o out.yaml
1 | no_y.csv | world new --path no_y.csv --tag-size-m 0.1 -o out.yaml
1 | word.csv:3 | world new --path word.csv --tag-size-m 0.1 -o out.yaml
1 | nan.csv:3 | world new --path nan.csv --tag-size-m 0.1 -o out.yaml
1 | twice.csv | world new --path twice.csv --tag-size-m 0.1 -o out.yaml
1 | ragged.csv:3 | world new --path ragged.csv --tag-size-m 0.1 -o out.yaml
1 | photograph.png | world new --path photograph.png --tag-size-m 0.1 -o out.yaml
1 | world.yaml | world new --path line.csv --tag-size-m 0.1 -o world.yaml
1 | text.yaml | world check text.yaml
1 | world_nan.yaml | world check world_nan.yaml
1 | photograph.png | world orbit photograph.png
1 | photos | world export world.yaml --sdf photos
1 | bad.sdf | world import bad.sdf -o out.yaml
1 | no_camera.mcap | world from-recording no_camera.mcap --map map -o out
1 | photos | world from-recording lap.mcap --map map -o photos
1 | locked | tags sheet --ids 0 --tag-size-m 0.05 -o locked/tags.pdf
1 | none/ | tags board --tag-size-m 0.02 -o none/board.pdf
"""
WORDS_TABLE = """
2 | detect | detcet photograph.png
2 | sheet | tags shet --ids 0 --tag-size-m 0.05 -o out.pdf
2 | --annotate | detect photograph.png --anotate seen
2 | localize robot | localize log lap.mcap --map map --view
2 | map video | map lap lap.mcap -o out --upright 3
2 | --map | localize log lap.mcap --map
2 | -o | teach --world world.yaml
2 | --tag-size-m | tags sheet --ids 0 -o out.pdf
2 | 0.1m | tags sheet --ids 0 --tag-size-m 0.1m -o out.pdf
2 | 16cm | detect photograph.png --camera camera.yaml --tag-size-m 16cm
2 | 160 | detect photograph.png --camera camera.yaml --tag-size-m 160
2 | 160 | calibrate camera photos --cols 6 --rows 6 --tag-size-m 160 -o out.yaml
2 | -0.1 | detect photograph.png --camera camera.yaml --tag-size-m -0.1
2 | nan | detect photograph.png --camera camera.yaml --tag-size-m nan
2 | 0,16 | tags board --tag-size-m 0,16 -o out.pdf
2 | 36h11 | detect photograph.png --family 36h12
2 | tag36h11 | tags sheet --ids 0 --tag-size-m 0.05 --family tag63h11 -o out.pdf
2 | 587 | tags sheet --ids 587 --tag-size-m 0.05 -o out.pdf
2 | 3-1 | tags sheet --ids 3-1 --tag-size-m 0.05 -o out.pdf
2 | A9 | tags sheet --ids 0 --tag-size-m 0.05 --paper A9 -o out.pdf
2 | .gif | tags sheet --ids 0 --tag-size-m 0.05 -o out.gif
2 | --dpi | tags sheet --ids 0 --tag-size-m 0.05 --dpi 1 -o out.png
2 | tag | tags sheet --ids 0 --tag-size-m 0.5 -o out.pdf
2 | --cols | tags board --cols 0 --tag-size-m 0.02 -o out.pdf
2 | roomba | teach --robot roomba: --tag-size-m 0.1 --anchor 0 -o out.mcap
2 | limo | teach --robot limo --tag-size-m 0.1 --anchor 0 -o out.mcap
2 | lmio | teach --world world.yaml --robot-file lmio -o out.mcap
2 | circuit24 | teach --world circuit42 -o out.mcap
2 | 0.3m/s | teach --world world.yaml --speed-m-s 0.3m/s -o out.mcap
2 | 50 | teach --world world.yaml --speed-m-s 50 -o out.mcap
2 | --seed | teach --world world.yaml --seed -1 -o out.mcap
2 | xbox | teach --world world.yaml --driver xbox -o out.mcap
2 | out.txt | teach --world world.yaml -o out.txt
2 | ekff | replay map --world world.yaml --method ekff
2 | pid | replay map --world world.yaml --controller pid
2 | 0 | replay map --world world.yaml --laps 0
2 | kitchen | replay map --world world.yaml --route kitchen
2 | reach | replay map --world world.yaml --set follower.reach=1
2 | wide | replay map --world world.yaml --set follower.reach_m=wide
2 | follower.reach_m | replay map --world world.yaml --set follower.reach_m
2 | --port | view map --port 99999
1 | 203.0.113.1 | view map --listen 203.0.113.1
2 | 16 to 128 | view map --listen 127.0.0.1 --token short
2 | --at-m | routes map --station shelf --at-m -1
2 | 99 | routes map --station shelf --at-m 99
2 | tag36h11:99 | routes map --station shelf --at-tag tag36h11:99
2 | nowhere | routes map --remove-station nowhere
2 | --from | play lap.mcap --from soon
2 | --from | convert lap.mcap out.mcap --from 9 --to 3
2 | .xyz | convert lap.mcap out.xyz
1 | /nosuch | convert lap.mcap out.mcap --topics /nosuch
2 | --kind | convert lap.mcap out.csv --kind wheels
2 | florr | plot map --figure florr
2 | out.doc | plot map --figure map -o out.doc
2 | --to | map convert map out.yaml --to ros
1 | tag36h11:99 | map lap lap.mcap -o out --anchor 99
2 | magic | map lap lap.mcap -o out --method magic
2 | se4 | evaluate early.tum early.tum --alignment se4
2 | ascending | evaluate detections --truth truth.csv --size-edges-px 9,3 photograph.png
2 | jazz | convert lap.mcap out --format rosbag2 --ros-distro jazz
2 | --minutes | explore --minutes 0
2 | gazebo | world check gazebo
2 | hexagon | calibrate camera photos --target hexagon --cols 6 --rows 6 --tag-size-m 0.1 -o out.yaml
2 | --domain | ros2 topic list --domain 999
2 | lines | run --world world.yaml --driver line -o out
2 | samples | samples
2 | --verson | --verson
"""
DEVICES_TABLE = """
1 | /dev/video99 | cameras /dev/video99
1 | /dev/null | cameras /dev/null
1 | /dev/video99 | detect v4l2:/dev/video99
1 | /dev/video99 | detect v4l2:/dev/video99,exposur_ms=5
1 | webcam:0 | detect webcam:0
1 | /dev/video99 | convert v4l2:/dev/video99 out.mcap
1 | /dev/video99 | localize camera v4l2:/dev/video99 --camera camera.yaml --map map
1 | /dev/video99 | calibrate guided v4l2:/dev/video99 --cols 6 --rows 5 --tag-size-m 0.025 -o out.yaml
1 | /dev/ttyNothing | limo robot /dev/ttyNothing
1 | /dev/null | limo robot /dev/null
1 | lap.mcap | limo robot lap.mcap
1 | /dev/ttyNothing | localize robot --robot limo:/dev/ttyNothing --map map
2 | --driver | teach --robot limo:/dev/ttyNothing --driver scripted --tag-size-m 0.1 --anchor 0 -o out.mcap
1 | /dev/ttyNothing | replay map --robot limo:/dev/ttyNothing
2 | tcpq | mbot robot tcpq://nowhere
2 | 127.0.0.1 | mbot robot udpm://127.0.0.1:7667
2 | 99999 | mbot robot udpm://239.255.76.67:99999
2 | nosuch0 | ros2 robot limo --interface nosuch0
1 | ros2.yaml | ros2 robot ros2.yaml
2 | limmo | ros2 robot limmo
2 | turtlebot | teach --robot ros2:turtlebot --tag-size-m 0.1 --anchor 0 -o out.mcap
2 | gazebo | gazebo robot limmo
1 | nosuchprogram | localize robot --robot process:nosuchprogram --robot-file robot.yaml --map map
1 | terminal | teach --robot process:true --robot-file robot.yaml --tag-size-m 0.1 --anchor 0 --driver keyboard -o out.mcap
1 | ended | localize robot --robot process:true --robot-file robot.yaml --map map
1 | exit | localize robot --robot "process:exit 3" --robot-file robot.yaml --map map
1 | hello | localize robot --robot "process:echo hello" --robot-file robot.yaml --map map
1 | 9 | localize robot --robot "process:cat hello.json" --robot-file robot.yaml --map map
2 | process | localize robot --robot process: --map map
1 | no running drive | stop
1 | No space left | detect photograph.png > /dev/full
1 | No space left | info lap.mcap --json > /dev/full
1 | No space left | robots > /dev/full
1 | /dev/full | teach --world world.yaml -o /dev/full
2 | /dev/full | tags sheet --ids 0 --tag-size-m 0.05 -o /dev/full
1 | /dev/full | map convert map /dev/full
1 | /dev/full | convert lap.mcap /dev/full --format mcap
"""
# The exception, what its text names, the call.
PYTHON_TABLE = """
NotFound | none.mcap | recording.Recording("none.mcap")
Unreadable | empty.mcap | recording.Recording("empty.mcap")
WaymarkError | photograph.png | recording.Recording("photograph.png")
NotFound | empty_folder | recording.Recording("empty_folder")
TypeError | path | recording.Recording(None)
InvalidArgument | /nosuch | recording.Recording("lap.mcap").samples(topics={"/nosuch"})
TypeError | from_ns | recording.Recording("lap.mcap").samples(from_ns="soon")
Unwritable | lap.mcap | recording.Writer("lap.mcap")
Unwritable | none/a.mcap | recording.Writer("none/a.mcap")
Unwritable | locked/a.mcap | recording.Writer("locked/a.mcap")
NotFound | none.yaml | camera.read_camera("none.yaml")
WaymarkError | camera_key.yaml:1 | camera.read_camera("camera_key.yaml")
WaymarkError | camera_nan.yaml:4 | camera.read_camera("camera_nan.yaml")
WaymarkError | camera_negative.yaml:4 | camera.read_camera("camera_negative.yaml")
WaymarkError | left | camera.read_camera("camera.yaml", name="left")
WaymarkError | text | camera.parse_camera("hello", "text")
InvalidArgument | fx | camera.pinhole(640, 480, float("nan"), 500, 320, 240)
InvalidArgument | -500 | camera.pinhole(640, 480, -500, 500, 320, 240)
InvalidArgument | 0 | camera.pinhole(0, 480, 500, 500, 320, 240)
InvalidArgument | 3 | camera.pinhole(640, 480, 500, 500, 320, 240, [1, 2, 3])
InvalidArgument | nan | camera.fisheye(640, 480, 500, 500, 320, 240, [float("nan"), 0, 0, 0])
InvalidArgument | (2,) | LENS.project([1, 2])
InvalidArgument | (3, 3) | LENS.unproject(np.eye(3))
InvalidArgument | 0 | LENS.scaled(0, 0)
InvalidArgument | 2 | LENS.with_intrinsics([1, 2])
NotFound | circuit42 | config.read_world("circuit42")
WaymarkError | world_nan.yaml | config.read_world("world_nan.yaml")
NotFound | roomba | config.read_robot("roomba")
WaymarkError | robot_key.yaml:5 | config.read_robot("robot_key.yaml")
WaymarkError | map_turn.yaml | config.read_map("map_turn.yaml")
WaymarkError | photograph.png | config.read_map("photograph.png")
WaymarkError | one_point | config.read_route("one_point/route.yaml")
WaymarkError | three.tum:1 | config.read_trajectory("three.tum")
InvalidArgument | tag | config.write_map("out.yaml", samples.TagMap())
Unwritable | photos | config.write_map("photos", MAP)
TypeError | tags | config.write_map("out.yaml", {})
TypeError | trajectory | config.to_tum([1, 2])
InvalidArgument | float64 | tags.Detector().detect(np.zeros((48, 64)))
InvalidArgument | (48, 64, 3) | tags.Detector().detect(np.zeros((48, 64, 3), np.uint8))
InvalidArgument | list | tags.Detector().detect([[0, 1], [2, 3]])
InvalidArgument | 64 | tags.Detector().detect(np.zeros((48, 64), np.uint8), LENS)
InvalidArgument | tag36h12 | tags.Detector(families=["tag36h12"])
InvalidArgument | max_haming | tags.Detector(max_haming=1)
InvalidArgument | 99 | tags.Detector(max_hamming=99)
InvalidArgument | tag36h12 | families.family("tag36h12")
InvalidArgument | 9999 | families.bitmap("tag36h11:9999")
InvalidArgument | x | geometry.SE2(float("nan"), 0, 0)
InvalidArgument | (3, 3) | geometry.SE3.from_matrix(np.eye(3))
InvalidArgument | rotation | geometry.SO3.from_matrix(np.eye(3) * 2)
InvalidArgument | 0 | geometry.SO3.from_quaternion([0, 0, 0, 0])
TypeError | SE2 | geometry.SE3() @ geometry.SE2(1, 2, 3)
TypeError | detection | pose.estimate_tag_pose(np.zeros((3, 2)), 0.1, LENS)
NotFound | none.mcap | mapping.map_recording("none.mcap", "out")
TypeError | methd | mapping.map_recording("lap.mcap", "out", methd="bundle")
InvalidArgument | magic | mapping.map_recording("lap.mcap", "out", method="magic")
InvalidArgument | tag_size_m | mapping.map_recording("lap.mcap", "out", tag_size_m=-1)
WaymarkError | no_tags.mcap | mapping.map_recording("no_tags.mcap", "out", tag_size_m=0.1)
Unwritable | photograph.png | mapping.map_recording("lap.mcap", "photograph.png")
InvalidArgument | kalman | localization.Localizer(MAP, ROBOT, method="kalman")
InvalidArgument | gaet | localization.Localizer(MAP, ROBOT, gaet=1)
InvalidArgument | tag | localization.Localizer(samples.TagMap(), ROBOT)
TypeError | robot | localization.Localizer(MAP, "limo")
TypeError | sample | localization.Localizer(MAP, ROBOT).add("odometry")
TypeError | int | localization.localize([3], MAP, ROBOT)
WaymarkError | photograph.png | localization.localize_recording("photograph.png", "map")
WaymarkError | empty_folder | localization.localize_recording("lap.mcap", "empty_folder")
NotFound | none | replay.ReplaySession("none")
WaymarkError | one_point | replay.ReplaySession("one_point")
NotFound | kitchen | replay.ReplaySession("map", route="kitchen")
InvalidArgument | pid | replay.ReplaySession("map", controller="pid")
InvalidArgument | nan | replay.ReplaySession("map", laps=float("nan"))
TypeError | robot | replay.drive("map", None)
TypeError | step | replay.drive("map", object())
InvalidArgument | -1 | replay.drive("map", IDLE, timeout_s=-1)
InvalidArgument | tag | evaluation.map_errors(samples.TagMap(), MAP)
InvalidArgument | se4 | evaluation.score_trajectory(EARLY, EARLY, alignment="se4")
NotFound | reference | evaluation.score_trajectory(EARLY, LATE)
TypeError | reference | evaluation.score_trajectory(EARLY, "late.tum")
InvalidArgument | max_gap_s | evaluation.pose_at(EARLY, 10**9, max_gap_s=-1)
TypeError | world | simulation.Simulator("circuit24", ROBOT)
InvalidArgument | seconds | simulation.Simulator(WORLD, ROBOT).advance(float("nan"))
InvalidArgument | speed_m_s | simulation.Simulator(WORLD, ROBOT).command(float("inf"), 0)
InvalidArgument | sped_m_s | simulation.scripted_lap(WORLD, ROBOT, sped_m_s=1)
InvalidArgument | size | simulation.photograph(LENS, [(1, geometry.SE3(), -1)])
InvalidArgument | range_m | samples.RangeBearing(range_m=float("nan"))
TypeError | stamp_ns | samples.Odometry(stamp=3)
InvalidArgument | (3, 2) | samples.TagDetection(tag=1, corners_px=np.zeros((3, 2)))
InvalidArgument | tag36h12 | samples.TagDetection(tag="tag36h12:1")
"""
# Evaluates the calls of standard input, one a line, each announced before it runs, since a crash ends the process.
PYTHON_CALLS = """
import json, sys
import numpy as np
from waymark import camera, config, errors, evaluation, families, geometry, localization, mapping, pose, recording, replay, samples, simulation, tags
LENS = camera.pinhole(640, 480, 500, 500, 320, 240)
WORLD, ROBOT, MAP = config.read_world("world.yaml"), config.read_robot("robot.yaml"), config.read_map("map/map.yaml")
EARLY, LATE = config.read_trajectory("early.tum"), config.read_trajectory("late.tum")
class Idle:
    def step(self, *_):
        return []
IDLE = Idle()
print("ready", flush=True)
for call in sys.stdin.read().splitlines():
    try:
        raised = None
        eval(call)
    except Exception as error:
        raised = error
    kinds = [kind.__name__ for kind in type(raised).__mro__]
    public = isinstance(raised, (errors.WaymarkError, TypeError, ValueError, KeyError))
    print(json.dumps({"call": call, "kinds": kinds, "text": str(raised), "public": public}), flush=True)
"""
# What depends on the computer or on a simulated lap, and is not on the page.
VARYING = (r"(at byte) \d+: a record of \d+ bytes", r"(Available:) .*", r"(This computer has) .*", r"(is not on a route of) \S+ m")
INTERNAL = ("internal error", "Traceback", "terminate called", "Assertion", "incompatible function arguments", "std::", "waymark::", "_waymark")


def rows_of(table):
    return [tuple(part.strip() for part in line.split(" | ", 2)) for line in table.strip().splitlines()]


def without_override():
    """Before the program starts: root may not write into read-only folders either."""
    capability = ctypes.CDLL(None)
    for override in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        capability.prctl(24, override, 0, 0, 0)  # PR_CAPBSET_DROP


class BadInputs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-bad-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        images.fill(cls.folder)
        shutil.copytree(made(*MAP_OF_SQUARE), cls.folder, dirs_exist_ok=True)

        def write(name, data):
            (cls.folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())

        for name, data in FILES.items():
            write(name, data)
        for kind in ("png", "mcap", "yaml"):
            write(f"empty.{kind}", b"")
        write("robot.yaml", (SHARE / "robots/limo.yaml").read_bytes())
        write("world.yaml", (SHARE / "worlds/mbot-square.yaml").read_bytes())
        write("line.csv", "x_m,y_m\n0,0\n1,0\n2,0\n")
        write("cut.png", (cls.folder / "photograph.png").read_bytes()[:500])
        write("cut.mcap", (cls.folder / "lap.mcap").read_bytes()[:20000])  # in its first chunk
        write("cut.bag", b"#ROSBAG V2.0\n\x45\0\0\0")
        write("cut.db3", b"SQLite format 3\0" + bytes(200))
        write("cut.csv.gz", b"\x1f\x8b\x08\0\0\0\0\0\0\3\x4b")
        stamps = [t * 10**8 for t in range(1, 60)]
        odometry = [("/odom", "nav_msgs/msg/Odometry", stamp, recordings.odometry(stamp)) for stamp in stamps]
        frames = [("/camera/tag_detections", "apriltag_msgs/msg/AprilTagDetectionArray", stamp, recordings.no_tags(stamp, "camera"))
                  for stamp in stamps]
        recordings.write(cls.folder / "no_camera.mcap", odometry)
        recordings.write(cls.folder / "no_tags.mcap", sorted(odometry + frames, key=lambda message: message[2]))
        for name in ("no_route", "one_point", "route_nan", "no_tags", "other_map"):
            shutil.copytree(cls.folder / "map", cls.folder / name)
        (cls.folder / "no_route/route.yaml").unlink()
        route = (cls.folder / "map/route.yaml").read_text()
        head, points = route.split("\npoints:\n")
        head = re.sub(r"\npoints_checksum.*", "", head)
        short = re.sub(r"(length_m|point_count|closing_gap_m): .*", lambda match: f"{match[1]}: {int(match[1] == 'point_count')}", head)
        write("one_point/route.yaml", f"{short}\npoints:\n{points.splitlines()[0]}\n")
        write("route_nan/route.yaml", f"{head}\npoints:\n{points.replace('[0.0,', '[.nan,', 1)}")
        write("no_tags/map.yaml", FILES["no_tags.yaml"])
        write("other_map/map.yaml", (cls.folder / "map/map.yaml").read_text().replace("tagCustom48h12", "tag36h11"))
        for source, name, old, new in EDITS:
            text = (cls.folder / source).read_text()
            assert old in text, (source, old)
            write(name, text.replace(old, new, 1))
        (cls.folder / "empty_folder").mkdir()
        (cls.folder / "locked").mkdir(mode=0o555)
        runtime = tempfile.mkdtemp(prefix="waymark-run-")
        cls.addClassCleanup(shutil.rmtree, runtime)
        cls.environment = {key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "IGN_", "WAYMARK_PAGES"))}
        cls.environment |= {"HOME": str(cls.folder), "XDG_RUNTIME_DIR": runtime, "ROS_LOCALHOST_ONLY": "1"}

    def state(self):
        return {str(path.relative_to(self.folder)): (path.lstat().st_mtime_ns, path.lstat().st_size) for path in self.folder.rglob("*")}

    def changes(self, before):
        return sorted({name for name, _ in before.items() ^ self.state().items()})

    def entry(self, name, text):
        for path, shown in ((f"{self.folder}/", ""), (harness.PROGRAM, "PROGRAM"), (os.path.realpath(harness.PROGRAM), "PROGRAM"),
                            (str(SHARE.parent), "PROJECT")):
            text = text.replace(path, shown)
        for pattern in VARYING:
            text = re.sub(pattern, r"\1 …", text)
        golden_page.expect(self, "bad_inputs", text, name=name)

    def check(self, code, named, words):
        before = self.state()
        command, _, out = words.partition(" > ")
        with open(out or os.devnull, "w", encoding="utf-8") as stdout:
            done = subprocess.run([harness.PROGRAM, *shlex.split(command)], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                  stdout=stdout if out else subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
                                  timeout=60, check=False,
                                  preexec_fn=without_override)
        text = f"exit {done.returncode}\n{done.stderr}"
        with self.subTest(words):
            self.entry(f"waymark {words}", text)
        with self.subTest(words):
            self.assertEqual(done.returncode, int(code), f"{text}\n{done.stdout}")
            self.assertIn(named, done.stderr)
            for word in INTERNAL:
                self.assertNotIn(word, text)
            self.assertEqual(self.changes(before), [], "files were written")
        for name in self.state().keys() - before.keys():  # so that later inputs do not meet it
            if (self.folder / name).is_dir():
                shutil.rmtree(self.folder / name, ignore_errors=True)
            else:
                (self.folder / name).unlink(missing_ok=True)

    def test_files(self):
        for row in rows_of(FILES_TABLE):
            self.check(*row)

    def test_words(self):
        for row in rows_of(WORDS_TABLE):
            self.check(*row)

    def test_devices_and_robots(self):
        for row in rows_of(DEVICES_TABLE):
            self.check(*row)

    def python_calls(self):
        rows = rows_of(PYTHON_TABLE)
        before = self.state()
        done = subprocess.run([sys.executable, "-c", PYTHON_CALLS], cwd=self.folder, env=self.environment,
                              input="\n".join(call for _, _, call in rows), capture_output=True, text=True, timeout=60, check=False,
                              preexec_fn=without_override)
        answers = [json.loads(line) for line in done.stdout.splitlines()[1:]]
        for (kind, named, call), answer in zip(rows, answers):
            with self.subTest(call):
                self.entry(f">>> {call}", f"{answer['kinds'][0]}\n{answer['text']}\n")
            with self.subTest(call):
                self.assertTrue(answer["public"], answer)
                self.assertIn(kind, answer["kinds"], answer)
                self.assertIn(named, answer["text"])
                for word in INTERNAL:
                    self.assertNotIn(word, answer["text"])
        last = rows[min(len(answers), len(rows) - 1)][2]
        self.assertEqual((done.returncode, len(answers)), (0, len(rows)), f"{done.stderr}\nthe process ended in {last}")
        self.assertEqual(self.changes(before), [], "files were written")


if WITH_PYTHON:  # the build has the Python package
    BadInputs.test_python = BadInputs.python_calls

if __name__ == "__main__":
    unittest.main()
