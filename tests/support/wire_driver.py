#!/usr/bin/python3
"""What `waymark` does with the process of a robot, for tests that kill whoever drives: a watchdog with the robot's process behind it, commands
twenty times a second.

usage: wire_driver.py WATCHDOG COMMAND...
"""
import json
import subprocess
import sys
import threading
import time


def drain(process):
    """Reads what comes from now on, so that the process never waits for its reader."""
    threading.Thread(target=lambda: [None for _ in process.stdout], daemon=True).start()


def greet(robot):
    """Waits for the hello of the process of a robot and answers as one that drives: it sends zero from then on."""
    robot.stdout.readline()
    drain(robot)
    say_hello(robot)


def say_hello(robot, **more):
    """The first line to the process of a robot, as the watchdog writes it."""
    robot.stdin.write(json.dumps({"type": "hello", "protocol_version": 1, "command_timeout_s": 0.25, **more}) + "\n")
    robot.stdin.flush()


def move(robot, speed_m_s, yaw_rate_rad_s, commands=20):
    """Drives the process of a robot for a second, by its own lines."""
    for i in range(commands):
        robot.stdin.write(json.dumps({"type": "velocity", "sequence": i + 1, "speed_m_s": speed_m_s, "yaw_rate_rad_s": yaw_rate_rad_s}) + "\n")
        robot.stdin.flush()
        time.sleep(0.05)


def end_of(words, environment=None, timeout=30):
    """Runs a program whose input is at its end from the beginning: exit code, standard output, standard error."""
    done = subprocess.run([str(word) for word in words], env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=timeout, check=False)
    return done.returncode, done.stdout, done.stderr


def doctor(program, robot, environment=None):
    """What `waymark doctor --robot` finds, by check; of several lines of a check the last."""
    words = [program, "doctor", "--robot", robot, "--rate-hz", "5", "--json"]
    return {line["check"]: line for line in json.loads(end_of(words, environment)[1])["checks"]}


def main():
    watchdog, *command = sys.argv[1:]
    robot = subprocess.Popen([watchdog, "--exec", *command], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    robot.stdout.readline()
    drain(robot)
    print("drives", flush=True)
    for i in range(10000):
        robot.stdin.write(b"command %d %d 0.3 0.1 0\n" % (i + 1, time.monotonic_ns()))
        robot.stdin.flush()
        time.sleep(0.05)


if __name__ == "__main__":
    main()
