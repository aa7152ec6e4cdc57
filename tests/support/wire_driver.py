#!/usr/bin/python3
"""Drives a robot process like `waymark`, for tests that kill the driver: a watchdog with the robot process behind it, commands at 20 Hz.

usage: wire_driver.py WATCHDOG COMMAND...
"""
import json
import subprocess
import sys
import threading
import time


def drain(process):
    """Reads and discards all further output, so that the process never blocks."""
    threading.Thread(target=lambda: [None for _ in process.stdout], daemon=True).start()


def greet(robot):
    """Waits for the hello of a robot process and answers as a driver; the process sends zero from then on."""
    robot.stdout.readline()
    drain(robot)
    send_hello(robot)


def send_hello(robot, **more):
    """Sends the first line to a robot process, as the watchdog writes it."""
    robot.stdin.write(json.dumps({"type": "hello", "protocol_version": 1, "command_timeout_s": 0.25, **more}) + "\n")
    robot.stdin.flush()


def move(robot, speed_m_s, yaw_rate_rad_s, commands=20):
    """Drives a robot process for a second with lines of its protocol."""
    for i in range(commands):
        robot.stdin.write(json.dumps({"type": "velocity", "sequence": i + 1, "speed_m_s": speed_m_s, "yaw_rate_rad_s": yaw_rate_rad_s}) + "\n")
        robot.stdin.flush()
        time.sleep(0.05)


def end_of(words, environment=None, timeout=30):
    """Runs a program with an empty input; returns exit code, standard output and standard error."""
    done = subprocess.run([str(word) for word in words], env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=timeout, check=False)
    return done.returncode, done.stdout, done.stderr


def doctor(program, robot, environment=None):
    """The lines of `waymark doctor --robot`, by check; of several lines of a check the last one."""
    words = [program, "doctor", "--robot", robot, "--rate-hz", "5", "--json"]
    return {line["check"]: line for line in json.loads(end_of(words, environment)[1])["checks"]}


def next_report(simulator):
    """The next line that a simulated robot prints, except for those that report a pause of a busy computer."""
    while "was suspended" in (line := simulator.stderr.readline()):
        pass
    return line


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
