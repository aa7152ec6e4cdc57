#!/usr/bin/python3
"""All flags of all verbs: --help shows few, each option works with --set and --config, options without effect are refused.

Shared options are tested with one verb; WAYMARK_FULL=1 tests every option of every verb.

usage: flags_test.py PROGRAM [unittest options]
"""
import functools
import os
import re
import unittest

import images
from harness import InFolder, waymark
import golden_page

FULL = bool(os.environ.get("WAYMARK_FULL"))
MOST = 20  # flags that --help shows

# Arguments that each verb with option structs needs before it checks them.
NEEDS = {
    "demo": "-o demo", "teach": "--world circuit24 -o lap.mcap", "map lap": "lap.mcap -o map", "map scene": "tags.bag --tagslam folder -o map",
    "map video": "walk.mp4 --camera camera.yaml --tag-size-m 0.1 -o map", "replay": "map --world circuit24",
    "optimize": "map", "run": "--world circuit24 --driver scripted -o session", "explore": "", "localize log": "lap.mcap --map map", "localize robot": "--robot process:true --map map",
    "simulate": "--like lap.mcap -o like.mcap", "robot-sim process": "--world circuit24",
    "robot-sim ros2": "--world circuit24", "robot-sim limo": "--world circuit24", "robot-sim mbot": "--world circuit24",
    "robot-sim gazebo": "limo --world circuit24", "detect": "photograph.png", "evaluate": "est.txt ref.txt",
    "evaluate detections": "--truth truth.csv", "calibrate camera": "photograph.png --cols 2 --rows 2 --tag-size-m 0.1",
    "calibrate guided": "walk.mp4 --cols 2 --rows 2 --tag-size-m 0.1",
    "calibrate robot": "lap.mcap", "tags sheet": "--ids 0 -o tags.pdf", "tags board": "-o board.pdf", "world new": "--path line.csv -o world.yaml",
    "world orbit": "circuit24", "convert": "lap.mcap path.tum"}

PROCESS = "--robot process:true --anchor 0 --tag-size-m 0.16"
# Flags that always have an effect, or whose effect does not depend on the command line alone (a topic of a recording).
EFFECTIVE = set("""
--help --help-all --version --config --set --json --output --robot --world --robot-file --view --laps --driver --anchor --tag-size-m
--speed-m-s --method --controller --calibration --route --figure --force --quick --format --topics --from --to --kind --tag-latency-s
--speed --messages --ids --family --paper --orientation --style --kalibr-yaml --like --lockstep --name --weights --map --minutes --est-topic
--ref-topic --odometry --figures --truth --detections --size-edges-px --tilt-edges-deg --lens --camera-info --cols --rows --by --path --station
--remove-station --prior --extend --tagslam --anchor-pose --base-frame --camera-frame --camera-topic --odometry-topic --imu-topic --sensor-pose
--start --annotate --camera --no-refine --images --faults --taught --remove --margin-m --per-page --spacing --first-id --most-tags --height-m
--duration-s --camera-source --controls --width-px --height-px --rate-hz --folder --clearance-m --durable --max-range-m --steps --sigma-m --sigma-deg --seed --recursive --publish-ros2 --ros2 --limo --mbot --gazebo --drive --beside --domain --localhost --interface --ros-distro --stamped --count --seconds --skip-lifted --simulated --share-commands --listen-only --sdf --models --plant --tag-at-m --guided
--wire-noise --wire-dropped --wire-torn --mbot-generation --resume --target
--every-s --detector --search-every --readout-ms --camera-name --camera-size
""".split())

# (verb, flag): a command line where the flag has no effect and is refused.
HAND = "v4l2:/dev/video0 --camera camera.yaml --map map"
SERVED = {"--port": "8000", "--listen": "0.0.0.0", "--token": "abcdefghijklmnop", "--open": ""}
WITHOUT_EFFECT = {
    **{(verb, flag): f"{NEEDS[verb]} {flag} {value}" for verb in ("demo", "teach", "replay", "run") for flag, value in SERVED.items()},
    **{(verb, "--threads"): f"{NEEDS[verb]} --threads 2" for verb in ("teach", "replay", "explore", "simulate")},
    **{(verb, flag): f"{NEEDS[verb]} {PROCESS} {flag} {value}".replace("--world circuit24", "")
       for verb in ("teach",) for flag, value in (("--images", ""), ("--faults", "faults.yaml"), ("--wander-m", "0.1"), ("--wander-time-s", "2"),
                                                  ("--overlap-m", "2"))},
    ("play", "--commands"): "lap.mcap --commands",
    ("teach", "--seed"): f"-o lap.mcap {PROCESS} --driver keyboard --seed 3",
    ("teach", "--second-speed-m-s"): f"{NEEDS['teach']} --driver keyboard --second-speed-m-s 0.2",
    ("teach", "--record-images"): f"{NEEDS['teach']} --record-images jpeg",
    ("teach", "--anchor"): f"{NEEDS['teach']} --anchor 0",
    ("teach", "--tag-size-m"): f"{NEEDS['teach']} --tag-size-m 0.16",
    ("replay", "--images"): "map --robot process:true --images",
    ("replay", "--faults"): "map --robot process:true --faults faults.yaml",
    ("replay", "--seed"): "map --robot process:true --seed 3",
    ("replay", "--record-images"): f"{NEEDS['replay']} --record-images jpeg",
    ("replay", "--durable"): f"{NEEDS['replay']} --durable",
    ("commission", "--yes"): "--world circuit24 --yes",
    ("run", "--images"): f"-o session {PROCESS} --images",
    ("run", "--seed"): f"-o session {PROCESS} --driver lines --seed 3",
    ("run", "--pace"): f"{NEEDS['run']} --pace 2",
    ("run", "--speed-m-s"): "-o session --world circuit24 --driver lines --speed-m-s 0.2",
    ("run", "--record-images"): f"{NEEDS['run']} --record-images jpeg",
    ("run", "--route"): f"{NEEDS['run']} --route kitchen",
    ("run", "--anchor"): f"{NEEDS['run']} --anchor 0",
    ("run", "--tag-size-m"): f"{NEEDS['run']} --tag-size-m 0.16",
    ("robot-sim process", "--pace"): f"{NEEDS['robot-sim process']} --pace 2",
    ("detect", "--covariance"): "photograph.png --covariance",
    ("detect", "--camera-name"): "photograph.png --camera-name left",
    ("evaluate", "--map"): "est.txt ref.txt --map map.yaml",
    ("evaluate", "--closed"): "est.txt ref.txt --closed",
    ("evaluate", "--alignment"): "est.txt corners.csv --alignment se2",
    ("evaluate", "--time-offset-s"): "est.txt corners.csv --time-offset-s 1",
    ("evaluate detections", "--recursive"): "--truth truth.csv --detections tags.jsonl --recursive",
    ("evaluate detections", "--family"): "--truth truth.csv --detections tags.jsonl --family tag16h5",
    ("evaluate detections", "--no-refine"): "--truth truth.csv --detections tags.jsonl --no-refine",
    ("calibrate camera", "--recursive"): "--detections tags.jsonl --cols 2 --rows 2 --tag-size-m 0.1 --recursive",
    ("calibrate camera", "--family"): "--detections tags.jsonl --cols 2 --rows 2 --tag-size-m 0.1 --family tag16h5",
    ("calibrate camera", "--no-refine"): "--detections tags.jsonl --cols 2 --rows 2 --tag-size-m 0.1 --no-refine",
    ("calibrate camera", "--spacing"): "photograph.png --map map.yaml --spacing 0.2",
    **{(verb, flag): f"{NEEDS[verb]} {flag} {value}" for verb in ("calibrate camera", "calibrate guided") for flag, value in (
        ("--format", "ros"), ("--force", ""), ("--square-size-m", "0.1"), ("--marker-size-m", "0.1"), ("--dictionary", "4x4_50"), ("--legacy-pattern", ""))},
    ("calibrate camera", "--target"): "photograph.png --map map.yaml --target charuco",
    **{("tags board", flag): f"{NEEDS['tags board']} --tag-size-m 0.02 {flag} {value}" for flag, value in (
        ("--square-size-m", "0.1"), ("--marker-size-m", "0.1"), ("--dictionary", "4x4_50"), ("--legacy-pattern", ""), ("--tiled", ""))},
    ("calibrate camera", "--first-id"): "photograph.png --map map.yaml --first-id 3",
    ("calibrate robot", "--map-sigma"): "lap.mcap --map-sigma 0.1",
    ("localize log", "--no-adapt"): f"{NEEDS['localize log']} --method anchor --no-adapt",
    ("map lap", "--route-name"): f"{NEEDS['map lap']} --route-name kitchen",
    ("map lap", "--freeze"): f"{NEEDS['map lap']} --freeze 3",
    ("map lap", "--remove"): f"{NEEDS['map lap']} --remove 3",
    ("map lap", "--map-sigma"): f"{NEEDS['map lap']} --map-sigma 0.1",
    ("map scene", "--free-intrinsics"): f"{NEEDS['map scene']} --model tagslam --free-intrinsics",
    **{("map scene", flag): f"{NEEDS['map scene']} --model tagslam {flag} 1" for flag in ("--tag-size-sigma-percent", "--common-tag-size-sigma-percent")},
    **{("map video", flag): f"{NEEDS['map video']} {flag} {value}" for flag, value in (
        ("--level-sigma-deg", "2"), ("--prior-sigma-m", "0.01"), ("--prior-sigma-deg", "1"))},
    **{("convert", flag): f"walk.mp4 walk.mcap {flag} {value}" for flag, value in (
        ("--format", "csv"), ("--topics", "/odom"), ("--from", "1"), ("--to", "2"), ("--kind", "imu"), ("--robot", "limo"), ("--tag-latency-s", "0.1"))},
    **{("convert", flag): f"{NEEDS['convert']} {flag} {value}" for flag, value in (("--ros-distro", "humble"), ("--storage", "mcap"))},
    **{("convert", flag): f"{NEEDS['convert']} {flag} {value}" for flag, value in (
        ("--record-images", "jpeg"), ("--camera", "camera.yaml"), ("--camera-name", "left"), ("--tag-size-m", "0.1"), ("--family", "tag16h5"),
        ("--no-refine", ""))},
    ("routes", "--at-m"): "map --at-m 1",
    ("routes", "--at-tag"): "map --at-tag 3",
    ("routes", "--pause-s"): "map --pause-s 3",
    ("plot", "--force"): "demo --force",
    ("plot", "--output"): "demo -o figure.svg",
    ("tags sheet", "--dpi"): "--ids 0 --tag-size-m 0.05 -o tags.pdf --dpi 600",
    ("tags board", "--dpi"): "--tag-size-m 0.02 -o board.pdf --dpi 600",
    ("tags board", "--kalibr-yaml"): "--style separate --tag-size-m 0.02 -o board.pdf --kalibr-yaml",
    **{(verb, flag): f"{needs} {flag} {value}" for flag, value in SERVED.items()
       for verb, needs in (("localize robot", NEEDS["localize robot"]), ("localize camera", HAND))},
    ("localize robot", "--record-images"): f"{NEEDS['localize robot']} --record-images jpeg",
    ("localize camera", "--record-images"): f"{HAND} --record-images jpeg",
    ("localize robot", "--search-strips"): f"{NEEDS['localize robot']} --search-strips",
    **{(verb, flag): f"{needs} {flag} {value}".strip() for flag, value in (("--detector", "waymark"), ("--search-every", "8"), ("--search-strips", ""))
       for verb, needs in (("commission", "--world circuit24"), *((verb, NEEDS[verb]) for verb in ("teach", "replay", "run")))},
    ("detect", "--camera-size"): "photograph.png --camera-size 640x480",
    ("convert", "--camera-size"): f"{NEEDS['convert']} --camera-size 640x480",
    **{("detect", flag): f"photograph.png {flag} {value}" for flag, value in SERVED.items()},
    **{("calibrate guided", flag): f"{NEEDS['calibrate guided']} {flag} {value}" for flag, value in SERVED.items()},
    # The page of `view` has no --view, so its flags always have an effect; so do flags that only one sub-verb has.
    **{("view", flag): "" for flag in SERVED},
    **{("map video", flag): "" for flag in ("--camera-name", "--camera-size", "--readout-ms", "--distance",
                                            "--upright", "--floor", "--plane")},
    **{("map scene", flag): "" for flag in ("--model", "--against")}}

# (verb, flag): a line without a sub-verb, which one it chooses, and which one has the flag.
OF_ANOTHER = {
    **{("map", flag): (f"lap.mcap -o map {flag} {value}", "map lap", of) for flag, value, of in (
        ("--readout-ms", "15", "map video"), ("--distance", "3,7,2.4", "map video"),
        ("--upright", "3", "map video"), ("--floor", "3", "map video"), ("--plane", "3,4", "map video"), ("--level-sigma-deg", "2", "map video"),
        ("--prior-sigma-m", "0.01", "map video"), ("--prior-sigma-deg", "1", "map video"), ("--camera-name", "left", "map video"),
        ("--camera-size", "640x480", "map video"), ("--model", "tagslam", "map scene"), ("--free-intrinsics", "", "map scene"),
        ("--against", "other", "map scene"), ("--force", "", "map convert"))},
    **{("map", f"{flag} of a scene"): (f"tags.bag -o map --tagslam folder {flag} {value}", "map scene", "map lap") for flag, value in (
        ("--robot", "limo"), ("--method", "chain"), ("--anchor", "0"), ("--anchor-pose", "0 0 0 0 0 0"), ("--tag-size-m", "0.1"),
        ("--world", "circuit24"), ("--prior", "map.yaml"), ("--extend", "map"), ("--base-frame", "base"), ("--camera-frame", "camera"),
        ("--camera-topic", "/camera"), ("--odometry-topic", "/odom"), ("--imu-topic", "/imu"), ("--family", "tag16h5"), ("--no-refine", ""),
        ("--find-mounting", ""), ("--smoothing-m", "0.2"))},
    **{("map", f"{flag} of a video"): (f"walk.mp4 -o map {flag} {value}", "map video", of) for flag, value, of in (
        ("--robot", "limo", "map lap"), ("--method", "chain", "map lap"), ("--extend", "map", "map lap"), ("--world", "circuit24", "map lap"),
        ("--camera-frame", "camera", "map lap"), ("--find-mounting", "", "map lap"), ("--model", "tagslam", "map scene"))}}

# A line without a sub-verb, with a flag that the implied sub-verb does not have; the implied one, and the owner of the flag.
OF_ANOTHER_VERB = [
    *((f"robot-sim --world circuit24 {words}", flag, f"robot-sim {meant}", f"robot-sim {owner}") for words, flag, meant, owner in (
        ("--beside fifo", "--beside", "process", "limo"), ("--wire-noise 0.1", "--wire-noise", "process", "limo"),
        ("--mbot-generation pi5", "--mbot-generation", "process", "mbot"), ("--plant process:true", "--plant", "process", "ros2"),
        ("--domain 3", "--domain", "process", "ros2"), ("--ros2 --lockstep", "--lockstep", "ros2", "process"),
        ("--limo --pace 2", "--pace", "limo", "process"), ("--limo --ros2", "--ros2", "limo", "ros2"), ("--gazebo limo --localhost", "--localhost", "gazebo", "ros2"),
        ("--mbot udpm://239.255.76.67:7667?ttl=0 --gazebo limo", "--gazebo", "mbot", "gazebo"))),
    ("calibrate camera photograph.png --view", "--view", "calibrate camera", "calibrate guided"),
    ("calibrate camera walk.mp4 --guided --map map.yaml", "--map", "calibrate guided", "calibrate camera"),
    ("calibrate camera v4l2:/dev/video0 --detections tags.jsonl", "--detections", "calibrate guided", "calibrate camera"),
    ("calibrate camera walk.mp4 --resume views --fastest-px-s 3", "--fastest-px-s", "calibrate guided", "calibrate camera")]

# (verb, section): a command line where none of its options has an effect. With keys: only these.
DETECTIONS = {"evaluate detections": "--truth truth.csv --detections tags.jsonl",
              "calibrate camera": "--detections tags.jsonl --cols 2 --rows 2 --tag-size-m 0.1"}
FOLLOWER = {"reach_m", "damping", "integral_most_m", "approach_rad"}
IDLE = [
    *((verb, section, NEEDS[verb], None) for verb in ("demo", "teach", "replay", "run", "explore", "simulate", "robot-sim process", "robot-sim limo")
      for section in ("camera", "scene")),
    *((verb, section, words, None) for verb, words in DETECTIONS.items() for section in ("detector", "refinement")),
    ("calibrate camera", "views", DETECTIONS["calibrate camera"], None),
    *(("convert", section, NEEDS["convert"], None) for section in ("detector", "refinement")),
    *((verb, "refinement", f"{NEEDS[verb]} --no-refine", None) for verb in ("detect", "calibrate camera", "calibrate guided")),
    ("map lap", "bundle", f"{NEEDS['map lap']} --method chain", None),
    ("replay", "anchor", NEEDS["replay"], None),
    ("replay", "filter", f"{NEEDS['replay']} --method anchor", None),
    ("replay", "pursuit", NEEDS["replay"], None),
    ("replay", "goal", f"{NEEDS['replay']} --controller pursuit", None),
    ("replay", "follower", f"{NEEDS['replay']} --controller pursuit", FOLLOWER),
    *((verb, "anchor", NEEDS[verb], None) for verb in ("localize log", "localize robot")),
    *((verb, "filter", f"{NEEDS[verb]} --method anchor", None) for verb in ("localize log", "localize robot")),
    *((verb, "filter", NEEDS[verb], {"lag_s"}) for verb in ("replay", "run", "demo", "explore", "localize log", "localize robot", "calibrate robot"))]

# A line that does not name its verb, the verb that is chosen, a flag with its value, and the verb that has it.
WALK = "walk.mp4 --camera camera.yaml --map map"
OF_ANOTHER_MODE = [
    *((NEEDS["localize log"], "localize log", flag, value, owner) for flag, value, owner in (
        ("--robot-file", "limo", "localize robot"), ("--camera-source", "v4l2:/dev/video0", "localize robot"), ("--detector", "waymark", "localize robot"),
        ("--search-every", "8", "localize robot"), ("--duration-s", "2", "localize robot"), ("--record-images", "jpeg", "localize robot"),
        ("--view", "", "localize robot"), ("--publish-ros2", "", "localize robot"), ("--every-s", "2", "localize robot"),
        ("--camera-name", "left", "localize camera"), ("--camera-size", "640x480", "localize camera"), ("--readout-ms", "2", "localize video"))),
    *((NEEDS["localize robot"], "localize robot", flag, value, "localize log") for flag, value in (
        ("--no-adapt", ""), ("--base-frame", "base"), ("--camera-frame", "camera"), ("--camera-topic", "/camera"), ("--odometry-topic", "/odom"),
        ("--imu-topic", "/imu"), ("--sensor-pose", "0 0 0"))),
    *((HAND, "localize camera", flag, value, "localize log") for flag, value in (
        ("--robot", "limo"), ("--calibration", "calibration.yaml"), ("--start", "0 0 0"), ("--method", "ekf"), ("--no-adapt", ""),
        ("--set", "filter.gate=0.9"), ("--gate", "0.9"))),
    (HAND, "localize camera", "--readout-ms", "2", "localize video"),
    *((WALK, "localize video", flag, value, owner) for flag, value, owner in (
        ("--method", "ekf", "localize log"), ("--config", "options.yaml", "localize log"), ("--view", "", "localize robot"),
        ("--duration-s", "2", "localize robot")))]


@functools.lru_cache(maxsize=None)
def help_of(verb, flag):
    return waymark(*verb.split(), flag).out


def flags_of(text):
    """The long name of each flag of a help text, in order."""
    lines = re.findall(r"^  (-[^ ]*)", text, re.M)
    return [next(name for name in line.split(",") if name.startswith("--")).split("{")[0] for line in lines]


def verbs(verb=""):
    if help_of(verb, "--help-all"):
        yield verb
    block = re.search(r"^Verbs:\n((?:  .*\n)+)", help_of(verb, "--help"), re.M)
    for line in block[1].splitlines() if block else []:
        if not line.startswith("   "):
            yield from verbs(f"{verb} {line.split()[0]}".strip())


def sections_of(verb):
    text = help_of(verb, "--help-all")
    listed = re.search(r"^Sections of --set and --config: ([^.]+)\.", text, re.M)
    return listed[1].replace("\n", " ").split(", ") if listed else []


def run(verb, *words):
    return waymark(*verb.split(), *NEEDS[verb].split(), *words)


def flag_of_another(flag, chosen, owner):
    """Matches a message with the flag, the verb that was chosen, and the verb that has the flag."""
    return rf"'{flag}'.*`waymark {chosen}`.*`waymark {owner}`"


LEAVES = {}  # (path, the keys there): all options below, which are the same for every verb with these keys


@functools.lru_cache(maxsize=None)
def keys_of(verb, path):
    """All options of a section, including nested structs, from the message about an unknown key."""
    known = re.search(r"'zzzzzzzzzz'\. Known: (.*)\. See `", run(verb, "--set", f"{path}.zzzzzzzzzz=1").err)
    if not known:
        return [path]
    if (path, known[1]) not in LEAVES:
        LEAVES[path, known[1]] = [leaf for key in known[1].split(", ") for leaf in keys_of(verb, f"{path}.{key}")]
    return LEAVES[path, known[1]]


def keys_to_try(tried, verb, section):
    """The options of a section: all with WAYMARK_FULL, else the first one and those not tested with another verb."""
    keys = keys_of(verb, section)
    chosen = [key for number, key in enumerate(keys) if FULL or number == 0 or key not in tried]
    tried.update(keys)
    return chosen


class Flags(InFolder):
    def test_help_shows_few_flags_and_the_number_of_others(self):
        for verb in verbs():
            shown, all_of_them = flags_of(help_of(verb, "--help")), flags_of(help_of(verb, "--help-all"))
            self.assertLessEqual(len(shown), MOST, verb)
            self.assertLessEqual(set(shown), set(all_of_them), verb)
            more = re.search(r"^(\d+) more: --help-all", help_of(verb, "--help"), re.M)
            self.assertEqual(int(more[1]) if more else 0, len(all_of_them) - len(shown), verb)
        self.assertGreater(len(flags_of(help_of("replay", "--help-all"))), 100)

    def test_verbs_that_have_options_by_name_are_in_the_table(self):
        with_options = {verb for verb in verbs() if sections_of(verb)}
        self.assertEqual(with_options, set(NEEDS))
        for verb in verbs():
            self.assertEqual(verb in with_options, "--set" in flags_of(help_of(verb, "--help")), verb)

    def test_every_option_is_reached_by_set_and_by_a_file(self):
        tried, count = set(), 0
        for verb, key in ((verb, key) for verb in NEEDS for section in sections_of(verb) for key in keys_to_try(tried, verb, section)):
            count += 1
            text = help_of(verb, "--help-all")
            flag = "--" + key.rsplit(".", 1)[1].replace("_", "-")
            self.assertTrue(flag in flags_of(text) or f"  {key}=" in text, f"{verb}: --help-all does not show {key}")
            argument = f"{key}={{}}"  # an empty map is invalid for every option
            outcome = run(verb, "--set", argument)
            self.assertEqual(outcome.code, 2, f"{verb} {argument}")
            self.assertIn(f"(--set {argument}): ", outcome.err, verb)
            self.assertNotIn("unknown", outcome.err, verb)
            *path, last = key.split(".")
            lines = [f"{'  ' * depth}{name}:" for depth, name in enumerate(path)] + [f"{'  ' * len(path)}{last}: {{}}"]
            file = self.folder / "options.yaml"
            file.write_text("\n".join(lines) + "\n")
            outcome = run(verb, "--config", file)
            self.assertEqual(outcome.code, 1, f"{verb} {key}")
            self.assertIn(f"options.yaml:{len(lines)} ({key}): ", outcome.err, verb)
        print(f"{count} options of {len(NEEDS)} verbs")
        self.assertGreater(count, 400 if FULL else 200)

    def test_an_unknown_section_gets_a_suggestion(self):
        for verb in NEEDS:
            section = sections_of(verb)[0]
            outcome = run(verb, "--set", f"{section}x.key=1")
            self.assertEqual(outcome.code, 2, verb)
            self.assertIn(f"'{section}'?", outcome.err)
            (self.folder / "options.yaml").write_text(f"# mine\n{section}x:\n  key: 1\n")
            outcome = run(verb, "--config", self.folder / "options.yaml")
            self.assertEqual(outcome.code, 1, verb)
            self.assertIn(f"options.yaml:2 ({section}x): ", outcome.err)
            self.assertIn(f"'{section}'?", outcome.err)

    def fill(self):
        """Writes the files without which a mistake would not be reached."""
        (self.folder / "corners.csv").write_text("x_m,y_m\n0,0\n1,0\n1,1\n")
        for name in ("est.txt", "ref.txt"):
            (self.folder / name).write_text("".join(f"{t} {t} 0 0 0 0 0 1\n" for t in range(5)))
        (self.folder / "tags.jsonl").write_text("")
        (self.folder / "walk.mp4").write_bytes(b"\0\0\0\x18ftypmp42")
        (self.folder / "camera.yaml").write_text(images.CAMERA)
        (self.folder / "map.yaml").write_text('format: waymark-map-1\nanchor: "tag36h11:7"\ntags:\n'
                                              '  - {tag: "tag36h11:7", size_m: 0.1, position_m: [1, 0, 0], quaternion_xyzw: [-0.5, 0.5, -0.5, 0.5]}\n')

    def refused(self, verb, words, *named):
        outcome = self.run_here(*verb.split(), *words)
        self.assertEqual((outcome.code, outcome.out), (2, ""), f"waymark {verb} {' '.join(words)}\n{outcome.err}")
        for name in named:
            self.assertIn(name, outcome.err, f"waymark {verb} {' '.join(words)}")
        return outcome

    def test_a_flag_without_effect_is_refused(self):
        self.fill()
        for (verb, flag), words in WITHOUT_EFFECT.items():
            self.assertIn(flag, flags_of(help_of(verb, "--help-all")), verb)
            if words:
                self.refused(verb, words.split(), flag)

    def test_a_flag_of_another_verb_is_refused_and_that_verb_is_named(self):
        for words, flag, meant, owner in OF_ANOTHER_VERB:
            outcome = self.run_here(*words.split())
            self.assertEqual((outcome.code, outcome.out), (2, ""), f"waymark {words}\n{outcome.err}")
            self.assertRegex(outcome.err, flag_of_another(flag, meant, owner), words)
        golden_page.expect(self, "cli", outcome.err)  # one message for all

    def test_a_flag_of_another_sub_verb_is_refused_and_that_sub_verb_is_named(self):
        self.fill()
        for (verb, flag), (words, chosen, other) in OF_ANOTHER.items():
            outcome = self.refused(verb, words.split(), f"waymark {verb}: ")
            self.assertRegex(outcome.err, flag_of_another(flag.split()[0], chosen, other), words)

    def test_a_flag_of_another_mode_is_refused_and_its_verb_is_named(self):
        self.fill()
        for line, chosen, flag, value, owner in OF_ANOTHER_MODE:
            verb = chosen.split()[0]
            self.assertIn(flag, flags_of(help_of(owner, "--help-all")))
            self.assertNotIn(flag, flags_of(help_of(chosen, "--help-all")))
            outcome = self.refused(verb, [*line.split(), flag, *value.split()])
            self.assertRegex(outcome.err, flag_of_another(flag, chosen, owner), line)

    def test_a_flag_of_videos_without_the_flag_that_it_refers_to_is_refused(self):
        self.fill()
        for words in ("--level-sigma-deg 2", "--prior-sigma-m 0.01", "--prior-sigma-deg 1",
                      "--anchor-pose 0 0 0 0 0 0 --anchor 3,7 --prior map.yaml",
                      "--anchor-pose 0 0 0 0 0 0 --prior map.yaml --prior-sigma-m 0.01"):
            self.refused("map", f"walk.mp4 -o map --camera camera.yaml --tag-size-m 0.1 {words}".split(), words.split()[0])

    def test_every_flag_has_an_effect_or_is_refused(self):
        for verb in verbs():
            options = {"--" + key.rsplit(".", 1)[1].replace("_", "-") for section in sections_of(verb) for key in keys_of(verb, section)}
            for flag in flags_of(help_of(verb, "--help-all")):
                self.assertTrue(flag in options or flag in EFFECTIVE or (verb, flag) in WITHOUT_EFFECT,
                                f"waymark {verb} {flag}: where has it no effect, and is it refused there? Add it to the table.")

    def test_options_of_unused_parts_are_refused(self):
        self.fill()
        tried = set()
        for verb, section, words, keys in IDLE:
            flags = flags_of(help_of(verb, "--help-all"))
            for key in keys_of(verb, section) if keys else keys_to_try(tried, verb, section):
                name = key.split(".", 1)[1]
                if keys and name not in keys:
                    continue
                usual = self.usual(verb, key)
                self.refused(verb, [*words.split(), "--set", f"{key}={usual}"], f"(--set {key}={usual}): ")
                flag = "--" + name.rsplit(".", 1)[-1].replace("_", "-")
                if flag in flags and usual not in ("true", "false"):
                    self.refused(verb, [*words.split(), flag, usual], flag)

    @staticmethod
    def usual(verb, key):
        """The default of an option, by the help; 1 if it depends on other values."""
        text = help_of(verb, "--help-all")
        listed = re.search(rf"^  {re.escape(key)}=(\S*)", text, re.M)
        if listed:
            return listed[1]
        flag = key.rsplit(".", 1)[1].replace("_", "-")
        found = re.search(rf"^  --{flag}(?![\w-])(,--no-{flag}\S*)?(?: \S+?=(\S+))?", text, re.M)
        return "true" if found[1] else found[2] or "1"


if __name__ == "__main__":
    unittest.main()
