"""Runs Waymark with the plant: teach, map, replay, in a folder of its own."""
import dataclasses
import json
import os
import pathlib
import pty
import shlex
import subprocess
import sys
import time

import body
import course

ROBOT = pathlib.Path(__file__).resolve().parent / "robot.py"


@dataclasses.dataclass
class Run:
    code: int
    report: dict
    out: str
    err: str


def process(options: list[str], truth: pathlib.Path) -> str:
    return "process:exec " + shlex.join(["/usr/bin/python3", str(ROBOT), *options, "--truth", str(truth)])


class Place:
    """A folder with the robot file, a lap, its map and replays."""

    def __init__(self, program: str, folder: pathlib.Path, assumed: body.Camera | None = None):
        self.program, self.folder = str(pathlib.Path(program).resolve()), folder
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "robot.yaml").write_text(body.robot_yaml(assumed or body.Camera()))

    def waymark(self, *words: str, timeout_s: float = 900, environment: dict | None = None) -> Run:
        done = subprocess.run([self.program, *words], cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=timeout_s, check=False, env=environment)
        return Run(done.returncode, first_object(done.stdout), done.stdout, done.stderr)

    def teach(self, options: list[str], speed_m_s: float = 0.3, name: str = "lap", timeout_s: float = 900) -> Run:
        """Teaches as by a person, in real time: the plant drives itself, and a simulated keyboard only presses q at the end."""
        return self.teach_robot(process([*options, "--teach", str(speed_m_s), "--send-commands"], self.folder / f"{name}.csv"), name, timeout_s)

    def teach_robot(self, robot: str, name: str = "lap", timeout_s: float = 900, environment: dict | None = None,
                    anchor: str = str(course.ANCHOR)) -> Run:
        """Teaches with any robot that drives itself and writes its true poses to `name`.csv. FILE.go is created when its samples are recorded."""
        truth, recording = self.folder / f"{name}.csv", self.folder / f"{name}.mcap"
        words = [self.program, "teach", "--robot", robot, "--robot-file", "robot.yaml", "--anchor", anchor,
                 "--tag-size-m", str(course.TAG_SIZE_M), "--driver", "keyboard", "-o", str(recording), "--json"]
        keys, terminal = pty.openpty()
        with subprocess.Popen(words, cwd=self.folder, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as child:
            os.close(terminal)
            os.set_blocking(keys, False)
            deadline = time.monotonic() + timeout_s
            while child.poll() is None and time.monotonic() < deadline and not truth.with_suffix(".done").exists():
                time.sleep(0.05)
                if recording.exists() and recording.stat().st_size > 20_000:
                    truth.with_suffix(".go").touch()
            if child.poll() is None:
                os.write(keys, b"q")
            try:
                out, err = child.communicate(timeout=60)
            except subprocess.TimeoutExpired:
                child.kill()
                out, err = child.communicate()
        os.close(keys)
        return Run(child.returncode, first_object(out.decode()), out.decode(), err.decode())

    def teach_fast(self, options: list[str], speed_m_s: float = 0.3, name: str = "lap") -> Run:
        """Teaches as fast as the plant runs: it also drives itself, but its recording contains the ground truth and the anchor pose is given."""
        count = int(options[options.index("--tags") + 1]) if "--tags" in options else course.TAGS
        (self.folder / "world.yaml").write_text(course.world_yaml(count))
        robot = process([*options, "--teach", str(speed_m_s), "--send-commands", "--send-truth"], self.folder / f"{name}.csv")
        return self.waymark("teach", "--robot", robot, "--robot-file", "robot.yaml", "--world", "world.yaml", "--driver", "scripted",
                            "-o", f"{name}.mcap", "--json")

    def map(self, *words: str, name: str = "lap", output: str = "map") -> Run:
        return self.waymark("map", f"{name}.mcap", "-o", output, "--json", *words)

    def replay(self, options: list[str], *words: str, name: str = "replay", output: str = "map") -> Run:
        return self.waymark("replay", output, "--robot", process(options, self.folder / f"{name}.csv"), "--json", *words)


def first_object(text: str) -> dict:
    for line in text.splitlines():
        if line.startswith("{"):
            return json.loads(line)
    return {}


def complain(run: Run) -> None:
    print(f"exit {run.code}\n{run.out}\n{run.err}", file=sys.stderr)
