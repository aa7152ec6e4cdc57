"""The commands that same_bytes.py compares, one per line: NAME [< INPUT ...] : COMMAND LINE [# exit N]

Each runs in a fresh folder with the files of START, a link data to WAYMARK_DATA, and the files that the commands after < have written in the
reference. A command line begins with a verb of waymark, or with @NAME for the example program waymark_NAME, @lab NN for the solution of a lab, @stubs
for the type stubs of the Python package. A command whose data, example or Python package is missing is skipped and counted.
"""

COMMANDS = """
version : --version
robots : robots
robots.limo : robots limo
samples : samples samples --json

teach.1 : teach --world circuit24 --seed 1 -o lap.mcap --json
teach.2 : teach --world circuit24 --seed 2 -o lap2.mcap
teach.3 : teach --world circuit24 --seed 3 -o lap3.mcap --json
teach.square : teach --world mbot-square --seed 3 -o square.mcap --json
teach.house : teach --world academy-house --seed 1 -o house.mcap
teach.ackermann : teach --world limo-walls --robot-file limo-ackermann --seed 4 -o walls.mcap --json
teach.two_cameras : teach --world limo-walls --robot-file limo-front-rear --seed 2 -o two.mcap
teach.images : teach --world short.yaml --images --set camera.exposure_ms=20 --set scene.ink_gloss=0.1 --seed 1 -o dim.mcap --json
teach.faults : teach --world circuit24 --faults faults.yaml --seed 5 -o gaps.mcap
teach.process : teach --robot "process:waymark robot-sim --world short.yaml --lockstep" --world short.yaml --driver scripted -o lap.mcap
run : run --world circuit24 --driver scripted --seed 1 -o session --json
explore : explore --world academy-house --minutes 0.3 --seed 1 --json
commission : commission --world circuit24 --seed 1 --json
demo : demo --seed 4 -o demo --json

map.1 < teach.1 : map lap.mcap -o map --json
map.2 < teach.2 : map lap2.mcap -o map
map.3 < teach.3 : map lap3.mcap -o map --json
map.square < teach.square : map square.mcap -o map --json
map.house < teach.house : map house.mcap -o house --json
map.two_cameras < teach.two_cameras : map two.mcap -o two --json
map.images < teach.images : map dim.mcap -o map --set bundle.corner_sigma_px=0.3 --json
map.chain < teach.1 : map lap.mcap -o chain --method chain --json
map.anchor < teach.1 : map lap.mcap -o there --anchor 5 --anchor-pose 1 2 0.3 -90 0 -90 --json
map.extend < map.1 teach.2 : map lap2.mcap -o map --extend map --route-name evening --json
map.freeze < map.1 teach.2 : map lap2.mcap -o map --extend map --freeze 5,6 --remove tag36h11:7 --json
map.gaps < teach.faults : map gaps.mcap -o gaps --json
map.golden : map golden.mcap -o again --json
routes < map.1 : routes map --station shelf --at-m 4.5 --pause-s 3 --json
routes.list < map.extend : routes map --json
optimize < map.1 : optimize map --name fast --speed-m-s 0.8 --json

localize.1 < teach.1 map.1 : localize lap.mcap --map map/map.yaml -o estimate.mcap --json
localize.2 < teach.2 map.1 : localize lap2.mcap --map map -o estimate.mcap
localize.3 < teach.3 map.1 : localize lap3.mcap --map map -o estimate.mcap --json
localize.smoother < teach.2 map.1 : localize lap2.mcap --map map --method smoother -o smooth.mcap --json
localize.anchor < teach.2 map.1 : localize lap2.mcap --map map --method anchor -o anchor.mcap --json
localize.lag < teach.2 map.1 : localize lap2.mcap --map map --method smoother --lag-s 1 -o lagged.tum --json
localize.two_cameras < teach.two_cameras map.two_cameras : localize two.mcap --map two -o estimate.mcap --json
localize.images < teach.images map.images : localize dim.mcap --map map -o estimate.mcap --json
localize.golden : localize golden.mcap --map golden/map.yaml -o estimate.mcap --json

replay.1 < map.1 : replay map --world circuit24 --seed 1001 -o replay.mcap --json
replay.laps < map.1 : replay map --world circuit24 --seed 12 --laps 2
replay.2 < map.2 : replay map --world circuit24 --seed 11 --config careful.yaml -o replay.mcap --json
replay.3 < map.3 : replay map --world circuit24 --seed 1003 -o replay.mcap --json
replay.square < map.square : replay map --world mbot-square --seed 5 -o replay.mcap --json
replay.pursuit < map.1 : replay map --world circuit24 --seed 13 --controller pursuit --set pursuit.look_ahead_m=0.4 --speed-m-s 0.4 -o pursuit.mcap --json
replay.fast < map.1 optimize : replay map --world circuit24 --seed 13 --route fast --speed-m-s 0.5 --json
replay.station < map.1 routes : replay map --world circuit24 --seed 14 --json
replay.anchor < map.1 : replay map --world circuit24 --seed 7 --method anchor --json
replay.blackout < map.1 : replay map --world circuit24 --seed 3 --faults blackout.yaml -o dark.mcap --json # exit 1
replay.refused < map.1 : replay map --world circuit24 --min-clearance-m 5 # exit 1
replay.two_cameras < map.two_cameras : replay two --world limo-walls --seed 7 -o drive.mcap --json
replay.images < map.images : replay map --world short.yaml --images --seed 6 -o drive.mcap --json
experiment : experiment grid.yaml -o experiment --json

evaluate.1 < teach.1 localize.1 : evaluate estimate.mcap lap.mcap --odometry lap.mcap --json
evaluate.2 < teach.2 map.1 localize.2 : evaluate estimate.mcap lap2.mcap --odometry lap2.mcap --map map/map.yaml --figures figures
evaluate.3 < teach.3 localize.3 : evaluate estimate.mcap lap3.mcap --odometry lap3.mcap --json
evaluate.tum < teach.2 localize.lag : evaluate lagged.tum lap2.mcap --alignment se2 --json
evaluate.detections : evaluate detections --truth truth.csv photograph.png photos --json
report < teach.1 map.1 replay.1 : report map replay.mcap lap.mcap -o report.html
plot < demo : plot demo
plot.floor < demo : plot demo --figure floor -o floor.pdf
info < teach.1 : info lap.mcap --json
info.words < replay.1 : info replay.mcap
info.gaps < teach.faults : info gaps.mcap --json
play < teach.1 : play lap.mcap --speed 0 --from 5 --to 7 --json
play.messages < replay.1 : play replay.mcap --speed 0 --from 2 --to 4 --json --messages
recover < teach.1 : recover lap.mcap -o whole.mcap
simulate < teach.1 : simulate --like lap.mcap --world circuit24 -o like.mcap --json

convert.part < teach.1 : convert lap.mcap part.mcap --topics /odom,/imu --from 2 --to 10 --json
convert.tum < teach.1 : convert lap.mcap path.tum --topics /odom
convert.detections < teach.1 : convert lap.mcap seen.csv --kind detections
convert.odometry < teach.1 : convert lap.mcap drive.csv --kind odometry
convert.imu < teach.1 : convert lap.mcap gyro.csv --kind imu
convert.merge < convert.detections convert.odometry convert.imu : convert seen.csv drive.csv gyro.csv merged.mcap --robot limo --json
convert.rosbag2 < teach.1 : convert lap.mcap lap_bag --format rosbag2
convert.humble < teach.1 : convert lap.mcap humble_bag --format rosbag2 --ros-distro humble
map.tables < convert.detections convert.odometry : map seen.csv drive.csv --robot limo --tag-size-m 0.16 --anchor 0 -o tables --json
map.rosbag2 < convert.rosbag2 : map lap_bag --tag-size-m 0.16 --anchor 0 -o bag --json
map.convert < map.1 : map convert map layout.json --to wpilib
map.convert_back < map.convert : map convert layout.json back.yaml --tag-size-m 0.16 --json

world.check : world check circuit24 --json
world.check_poor : world check limo-walls # exit 1
world.orbit : world orbit circuit24 -o orbit.svg --json
world.export : world export circuit24 --sdf circuit
world.import < world.export : world import circuit/world.sdf -o circuit.yaml
world.new < teach.1 : world new --path lap.mcap -o mine.yaml --tag-size-m 0.12
world.twin < teach.1 map.1 : world from-recording lap.mcap --map map -o twin

detect : detect --json --covariance photos photograph.png
detect.words : detect photograph.png --annotate seen
detect.poses : detect photograph.png --camera camera.yaml --tag-size-m 0.1 --json
detect.samples < samples : detect samples/images --json
calibrate.camera < samples : calibrate camera samples/calibration --cols 6 --rows 5 --tag-size-m 0.03 -o calibration.yaml --json
calibrate.ros < samples : calibrate camera samples/calibration --cols 6 --rows 5 --tag-size-m 0.03 --camera-info info.yaml -o calibration.yaml
calibrate.robot < teach.1 : calibrate robot lap.mcap -o calibration.yaml --json
tags.pdf : tags sheet --family 36h11 --ids 0-23 --tag-size-m 0.16 --paper A4 -o tags.pdf
tags.svg : tags sheet --family standard41h12 --ids 0-5 --tag-size-m 0.06 --paper 300x400 -o own-paper.svg
tags.png : tags sheet --ids 0-2 --tag-size-m 0.1 --per-page 1 --dpi 300 -o tag.png
tags.sheet : tags sheet --ids 7 --tag-size-m 0.16 --paper A4 --dpi 300 -o sheet.png
tags.board : tags board --cols 6 --rows 6 --tag-size-m 0.03 --spacing 0.3 --paper A3 --kalibr-yaml -o april.pdf
tags.charuco : tags board --style charuco --cols 8 --rows 11 --square-size-m 0.02 --marker-size-m 0.015 --dictionary 4x4_50 -o charuco.pdf
tags.chessboard : tags board --style chessboard --cols 12 --rows 9 --square-size-m 0.05 --tiled -o chessboard.pdf

mbot.info : info data/lcm/lcmlog-2024-04-15.00 --json
mbot.convert : convert data/lcm/lcmlog-2024-04-15.00 log.mcap --json
mbot.map : map data/lcm/lcmlog-2024-04-15.00 -o map --prior data/lcm/landmarks.csv --json
mbot.localize : localize data/lcm/lcmlog-2024-04-15.00 --map data/lcm/landmarks.csv --robot mbot -o mbot.mcap --json
mbot.calibrate : calibrate robot data/lcm/lcmlog-2024-04-15.00 --map data/lcm/landmarks.csv --to 60 -o calibration.yaml --json
mbot.simulate : simulate --like data/lcm/lcmlog-2024-04-15.00 --world mbot-square --robot-file mbot -o like.mcap --json
aer.localize : localize data/aer1513/measurements.csv.gz data/aer1513/odometry.csv.gz --map data/aer1513/landmarks.csv --sensor-pose 0.219016 0 0 -o aer.mcap --json
aer.evaluate < aer.localize : evaluate aer.mcap data/aer1513/truth.csv.gz --odometry data/aer1513/odometry.csv.gz --json
photonvision.detect : detect data/photonvision/36h11_stress_test.png data/photonvision/robots.jpg data/photonvision/tag1_640_480.jpg --json
photonvision.16h5 : detect data/photonvision/162_36_Straight.png data/photonvision/383_60_Angle1.png --family 16h5 --json
photonvision.charuco : calibrate camera data/photonvision/charuco480 --target charuco --cols 8 --rows 8 --square-size-m 0.0254 --marker-size-m 0.01905 --dictionary 4x4_50 --lens radtan5 -o calibration.yaml --json
apriltag.detect : detect data/apriltag-images --json --covariance
synth.evaluate : evaluate detections --truth data/synth-tags/clean/truth.csv data/synth-tags/clean --json
wpical.layout : map convert data/wpical/2024-crescendo.json map.yaml --json
wpical.detect : detect data/wpical/field.mp4 --json
wpical.map : map data/wpical/field.mp4 --camera phone.yaml --tag-size-m 0.1651 -o map --json
paths.world : world new --path data/paths/ref_sim048.csv -o path.yaml --tag-size-m 0.16
conformance.info : info data/mcap-conformance/TenMessages/TenMessages-ch-chx-mx-rch-rsh-st-sum.mcap --json
conformance.bare : info data/mcap-conformance/TenMessages/TenMessages.mcap
tagslam.info : info data/tagslam/test_2/tag_detections.bag.bz2 --json
tagslam.convert : convert data/tagslam/test_16/tag_detections.bag.bz2 bag.mcap --json
""" + "".join(
    f"tagslam.{n} : map data/tagslam/test_{2 if n == 3 else n}/tag_detections.bag.bz2 --tagslam data/tagslam/test_{n} -o map --json\n"
    for n in (1, 2, 3, 4, 6, 7, 10, 15, 16, 18, 21, 22, 24)) + """
tagslam.model : map data/tagslam/test_16/tag_detections.bag.bz2 --tagslam data/tagslam/test_16 -o map --model tagslam --against data/tagslam/test_16 --json
tagslam.intrinsics : map data/tagslam/test_1/tag_detections.bag.bz2 --tagslam data/tagslam/test_1 -o map --free-intrinsics --json

example.detect : @detect photograph.png camera.yaml 0.1
example.map < teach.1 : @map lap.mcap map
example.localize < teach.1 map.1 : @localize lap.mcap map
example.own_robot < map.1 : @own_robot map
example.hamming : @hamming
example.photograph : @photograph .
example.sheet < tags.sheet : @photograph_sheet sheet.png .
example.effects : @camera_effects .
stubs : @stubs
""" + "".join(f"lab.{n:02} < samples : @lab {n:02}\n" for n in range(1, 13))

# Wrong uses, each of which ends with 1 or 2: named wrong.NUMBER.
WRONG = """
detcet photograph.png
detect
detect --anotate x photograph.png
detect --family tag36h12 photograph.png
detect --quad-decimate 0 photograph.png
detect --quad-decimate much photograph.png
detect none.png
detect empty.png
detect words.txt
detect empty.mp4
detect photogarph.png
detect lap*.png
detect photograph.png --covariance
detect photograph.png --camera none.yaml --tag-size-m 0.1
detect --config none.yaml photograph.png
detect --config unknown-key.yaml photograph.png
detect --config out-of-range.yaml photograph.png
detect --config cut.yaml photograph.png
evaluate
evaluate detection
evaluate est.txt none.txt
evaluate est.txt ref.txt --closed
evaluate est.txt ref.txt --map map.yaml
evaluate est.txt corners.csv --alignment se2
evaluate detections photograph.png
evaluate detections --truth truth.csv
evaluate detections --truth truth.csv --detections tags.jsonl --recursive
evaluate detections --truth truth.csv --size-edges-px 9,3 photos
teach --world circuit24 -o x --seed abc
teach --world circuit24 -o x --speed-m-s 9
teach --world circuit25 -o x
teach --world none.yaml -o x --driver scriptd
teach --world circuit24 -o folder.mcap
teach --world circuit24 -o /dev/null
teach --world circuit24 -o ./
teach --world circuit24 -o lap.mcap --anchor 0
teach --world circuit24 -o lap.mcap --driver keyboard --second-speed-m-s 0.2
teach --world circuit24 -o lap.mcap --faults wrong-faults.yaml
teach --world circuit24 -o x --robot-file none.yaml
teach --robot laser -o x
map none.mcap -o m
map words.txt -o m
map golden.mcap
map golden.mcap -o m --extend none
map golden.mcap -o m --world none.yaml
map golden.mcap -o m --method chian
map golden.mcap -o m --method chain --set bundle.corner_sigma_px=1
map golden.mcap -o m --freeze 3
map golden.mcap -o m --anchor 99
map golden.mcap -o m --set bundle.nosuch=1
map golden.mcap -o m --set nosuch.key=1
map golden.mcap -o m --tagslam folder --anchor 0
map convert none x.yaml
replay none --world circuit24
replay golden
replay golden --world circuit24 --laps 0
replay golden --world circuit24 --laps 1e
replay golden --world circuit24 --reach-m -1
replay golden --world mbot-square --route fast
replay golden --world circuit24 --set follower.reach=0.4
replay golden --world circuit24 --set follower.reach_m=far
replay golden --world circuit24 --set pursuit.look_ahead_m=0.4
replay golden --world circuit24 --calibration none.yaml
replay golden --world circuit24 --record-images jpeg
replay golden --robot process:true --seed 3
routes none
routes golden --pause-s 3
routes golden --at-m 1
optimize none
optimize golden --weights none.yaml
experiment none.yaml
localize none.mcap --map golden
localize golden.mcap --map none
localize golden.mcap --map golden --method kalman
localize golden.mcap --map golden --method anchor --no-adapt
localize golden.mcap --map golden --every-s 2
localize golden.mcap --map golden -o estimate.xyz
convert none.mcap x.mcap
convert golden.mcap lap.xyz
convert golden.mcap out.mcap --topics /odm
convert golden.mcap out.mcap --from noon
convert golden.mcap what.csv
convert golden.mcap no/such/folder/out.mcap
convert golden.mcap golden.mcap
info none.mcap
info words.txt
play golden.mcap --topics /odm
play golden.mcap --from 5 --to 4
play golden.mcap --speed -1
report none.mcap
plot none.mcap
recover none.mcap
simulate --like none.mcap -o x.mcap
world check none.yaml
world new --path none.csv -o x.yaml
world orbit circuit24 --sigma-deg 100
world orbit circuit24 -o orbit.gif
calibrate camera photograph.png --cols 2 --rows 2 --tag-size-m 0.1 -o folder.yaml
calibrate camera photograph.png --map map.yaml --first-id 3
calibrate robot none.mcap
tags sheet --ids 0 --tag-size-m 0.25 --paper A4 -o large.pdf
tags sheet --ids 0,x --tag-size-m 0.05 -o t.pdf
tags sheet --ids 0 --tag-size-m 0.05 -o t.gif
tags board --style round --cols 6 --rows 6 -o board.pdf
tags board -o board.pdf --tag-size-m 0.02 --square-size-m 0.1
demo --world none.yaml --set camera.exposure_ms=20
run --world circuit24 --driver scripted -o s --map none
explore --map none
commission --world circuit24 --yes
"""

# A recording and a map in the folder of every command.
START_COMMANDS = (("teach", "--world", "mbot-square", "--seed", "1", "-o", "golden.mcap"), ("map", "golden.mcap", "-o", "golden"))

# Text files in the folder of every command, in addition to the photographs of tests/cli/images.py.
START = {
    "short.yaml": """name: line
tag_family: tag36h11
tag_size_m: 0.16
anchor_id: 0
tags:
  - {id: 0, x_m: 2.6, y_m: 0.3, z_m: 0.3, facing_deg: 180}
  - {id: 1, x_m: 2.6, y_m: -0.3, z_m: 0.3, facing_deg: 180}
  - {id: 2, x_m: 2.6, y_m: 0, z_m: 0.5, facing_deg: 180}
path_closed: false
path_m: [[0, 0], [0.3, 0], [0.6, 0]]
""",
    "careful.yaml": """profile:
  speed_m_s: 0.2
safety:
  min_clearance_m: 0.08
filter:
  tag_sigma_m: 0.01
  motion:
    slide_m_s: 0.02
""",
    "grid.yaml": "{controllers: [follower, pursuit], speeds_m_s: [0.4], seeds: [1]}\n",
    "faults.yaml": "faults:\n  - {fault: camera_lost, at_s: 5, for_s: 2}\n  - {fault: odometry_lost, at_s: 20, for_s: 1.5}\n",
    "blackout.yaml": "faults:\n  - {fault: camera_blackout, at_s: 5}\n",
    "wrong-faults.yaml": "faults:\n  - {fault: tag_removd, id: 2}\n",
    "unknown-key.yaml": "detector:\n  quad_decimat: 2\n",
    "out-of-range.yaml": "detector:\n  quad_decimate: 99\n",
    "cut.yaml": "detector: [",
    "corners.csv": "x_m,y_m\n0,0\n1,0\n1,1\n",
    "phone.yaml": """image_width: 1920
image_height: 1080
camera_name: phone
camera_matrix: {rows: 3, cols: 3, data: [2124.8, 0, 989.3, 0, 2123.8, 537, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
""",
    "est.txt": "".join(f"{t} {t} 0 0 0 0 0 1\n" for t in range(5)),
    "ref.txt": "".join(f"{t} {t} 0 0 0 0 0 1\n" for t in range(5)),
    "tags.jsonl": "",
    "words.txt": "neither a recording nor an image\n",
    "empty.png": "",
    "empty.mp4": "",
    "folder.mcap/note.txt": "",
    "folder.yaml/note.txt": "",
}

# Fields that are not reproducible, by name and by printed file or stream and field, with _ for a space: the clock of a session continues while the map
# is made, which takes a varying time, and the replay starts at the time of the clock.
NOT_REPRODUCIBLE = {"run": ["files/session/replay.mcap", "stdout_mapping_s*", "stdout_replays*", "stdout_reason*", "stderr*"]}

# Twelve commands whose processor times are compared: the start of the program, each computing room, reading and writing files.
RATIOS = ["version", "teach.images", "map.1", "map.house", "tagslam.18", "localize.lag", "replay.laps", "synth.evaluate", "calibrate.camera",
          "convert.humble", "aer.evaluate", "report"]
