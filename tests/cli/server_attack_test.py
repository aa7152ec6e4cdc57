#!/usr/bin/python3
"""Attacks on the server of a running robot, only from 127.0.0.1: many connections, slow connections, seats taken without the token. Meanwhile the
owner of the token can connect, the recording continues, and any viewer can stop the robot.

usage: server_attack_test.py PROGRAM
"""
import contextlib
import os
import pathlib
import resource
import socket
import subprocess
import tempfile
import time

from live_client import Client, Refused
from live_test import PROGRAM, Robot

DESCRIPTORS = 160  # limit for the attacked program
SEATS = 48  # connections that it may then accept: (160 - 64) / 2


@contextlib.contextmanager
def few_descriptors():
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (DESCRIPTORS, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def upgrade_bytes(robot):
    return (f"GET /live HTTP/1.1\r\nHost: {robot.url.netloc.split('@')[-1]}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: waymark.v1\r\n\r\n").encode()


def flood(robot, count, data):
    """Opens this many connections that send only these bytes."""
    held = []
    for _ in range(count):
        one = socket.socket()
        one.settimeout(5)
        with contextlib.suppress(OSError):
            one.connect((robot.url.hostname, robot.url.port))
            one.sendall(data)
        held.append(one)
    return held


def wait_until(reached, what, seconds=60):
    """Waits until reached() holds, because a busy server answers late."""
    end = time.monotonic() + seconds
    while not reached():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.1)


def still_open(connections):
    """Number of connections, accepted or waiting, that the server has not closed."""
    count = 0
    for one in connections:
        one.setblocking(False)
        try:
            while one.recv(65536):
                pass
        except BlockingIOError:
            count += 1
        except OSError:
            pass
    return count


def descriptors_of(robot):
    return len(os.listdir(f"/proc/{robot.process.pid}/fd"))


def owner_gets_in(robot, seconds=5):
    start = time.monotonic()
    assert robot.ask(f"/session.json?token={robot.token}")[0] == 200
    client = robot.client()
    assert client.wait_for_op("control")["may"] is True
    assert time.monotonic() - start < seconds, "the owner had to wait"
    return client


def attacked_while_teaching(robot):
    owner = robot.client()
    owner.watch_state()
    owner.send(op="order", order="go")
    owner.wait_for_phase("teaching")
    with owner.looked_at():
        held = flood(robot, 400, upgrade_bytes(robot))  # web sockets count as connections
        assert descriptors_of(robot) < DESCRIPTORS - 20, descriptors_of(robot)
        owner.wait_for_state(lambda state: state["phase"] == "teaching")  # the existing connection stays open
        wait_until(lambda: still_open(held) <= SEATS, "more connections than seats")
        owner_gets_in(robot).close()
        held += flood(robot, 200, b"GET / HTTP/1.1\r\nHost: ")  # never finished
        assert descriptors_of(robot) < DESCRIPTORS - 20, descriptors_of(robot)
        owner_gets_in(robot).close()
        wait_until(lambda: still_open(held[400:]) == 0, "slow ones are dropped after a few seconds")
        owner.wait_for_state(lambda state: state["phase"] == "teaching")
    for one in held:
        one.close()
    assert "open files" not in robot.words(), robot.words()
    owner.close()


def viewers_without_the_token(robot):
    watchers = [robot.client(token=False) for _ in range(16)]
    full = 0
    for watcher in watchers:
        try:
            watcher.next()
        except ConnectionError:
            full += 1
    assert full == 4, full
    owner = owner_gets_in(robot)
    for watcher in watchers:
        watcher.close()
    owner.close()


def anybody_stops(robot):
    end = time.monotonic() + 10
    while True:  # the previous watchers may still be connected
        try:
            watcher = robot.client(token=False)
            watcher.watch_state()
            break
        except (ConnectionError, Refused):
            assert time.monotonic() < end
            time.sleep(0.2)
    owner = robot.client()
    owner.watch_state()
    if watcher.wait_for_state(lambda _: True)["phase"] != "teaching":
        owner.send(op="order", order="go")
        watcher.wait_for_phase("teaching")
    else:
        owner.send(op="take")
    with owner.looked_at():
        owner.wait_for_op("control", yours=True)
        watcher.send(op="order", order="go")
        assert "watch" in watcher.wait_for_op("status")["message"]
        watcher.send(op="order", order="stop")
        watcher.wait_for_phase("idle")
    foxglove = Client(robot.url, protocol="foxglove.sdk.v1", target="/")
    assert foxglove.wait_for_op("serverInfo")["capabilities"] == ["clientPublish"]
    foxglove.close()
    owner.close()
    watcher.close()


def stop(*environment):
    return subprocess.run([PROGRAM, "stop"], capture_output=True, text=True, check=False, timeout=60, env=os.environ | dict(environment))


def waymark_stop_works_in_a_flood(folder):
    """Two drives: `stop` reaches both while their servers are full."""
    runtime = ("XDG_RUNTIME_DIR", str(folder))
    assert stop(runtime).returncode == 1 and stop(runtime).stderr
    os.environ["XDG_RUNTIME_DIR"] = str(folder)
    robots = []
    for name in ("one", "two"):
        (folder / name).mkdir()
        robots.append(Robot(folder / name))
    held = []
    for robot in robots:
        owner = robot.client()
        owner.watch_state()
        owner.send(op="order", order="go")
        owner.wait_for_phase("teaching")
        held += [owner, *flood(robot, 200, upgrade_bytes(robot)), *flood(robot, 64, b"GET / HTTP/1.1\r\n")]
    start = time.monotonic()
    done = stop(runtime)
    assert done.returncode == 0 and done.stdout.count("(process ") == 2, done
    for robot in robots:
        assert f"(process {robot.process.pid})" in done.stdout
        assert robot.process.wait(timeout=20) == 130, robot.words()
        robot.log.close()
    assert time.monotonic() - start < 15
    for one in held:
        one.close()
    assert stop(runtime).returncode == 1
    assert not list((folder / "waymark").iterdir()), "sockets are removed with their drives"


def slow_ones_from_elsewhere():
    with tempfile.TemporaryDirectory(prefix="waymark-attack-") as folder, Robot(folder, "--listen", "0.0.0.0") as robot:
        held = flood(robot, 100, b"GET / HTTP/1.1\r\n")
        owner_gets_in(robot).close()
        for one in held:
            one.close()


def main():
    with tempfile.TemporaryDirectory(prefix="waymark-attack-") as folder:
        with few_descriptors():
            robot = Robot(folder, "--pace", "1")
        with robot:
            attacked_while_teaching(robot)
            viewers_without_the_token(robot)
            anybody_stops(robot)
        assert list(pathlib.Path(folder).rglob("*.mcap")), "the recording exists"
    slow_ones_from_elsewhere()
    with tempfile.TemporaryDirectory(prefix="waymark-stop-") as folder:
        waymark_stop_works_in_a_flood(pathlib.Path(folder))
    print("attacks: descriptors, slow connections, seats without the token, who may stop, waymark stop")


if __name__ == "__main__":
    main()
