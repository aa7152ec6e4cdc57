#!/usr/bin/python3
"""The live page over HTTP: access, control, loss of the viewer in control, clients that never read.

usage: live_test.py PROGRAM
"""
import http.client
import json
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
import urllib.parse

from live_client import Client, Refused

PROGRAM = sys.argv[1]


class Robot:
    """`waymark run --view` on the simulator."""

    def __init__(self, folder, *words):
        words = [str(word) for word in words]
        world = [] if words.count("--world") else ["--world", "circuit24"]
        self.log = open(pathlib.Path(folder) / "log.txt", "w+", encoding="utf-8")
        self.process = subprocess.Popen([PROGRAM, "run", *world, "-o", str(pathlib.Path(folder) / "session"), "--view", "--port", "0", *words],
                                        stdout=subprocess.DEVNULL, stderr=self.log)
        self.url = urllib.parse.urlsplit(re.search(r"http://\S+", self.wait_for_words("?token="))[0])
        self.token = urllib.parse.parse_qs(self.url.query)["token"][0]

    def words(self):
        self.log.flush()
        return (pathlib.Path(self.log.name)).read_text(encoding="utf-8")

    def wait_for_words(self, wanted, seconds=30):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if wanted in self.words():
                return self.words()
            assert self.process.poll() is None, self.words()
            time.sleep(0.05)
        raise TimeoutError(f"'{wanted}' was never printed: {self.words()}")

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(timeout=60)
        words = self.words()
        self.log.close()
        assert kind is not None or code == 130, f"{code}: {words}"

    def client(self, token=True, **more):
        target = f"/live?token={self.token}" if token is True else f"/live?token={token}" if token else "/live"
        return Client(self.url, target=target, **more)

    def ask(self, target, **headers):
        connection = http.client.HTTPConnection(self.url.hostname, self.url.port, timeout=20)
        connection.request("GET", target, headers=headers)
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer.status, dict(answer.getheaders()), body


def refused(robot, **how):
    try:
        robot.client(**how).close()
    except Refused as status:
        return status.args[0]
    return 101


def access(robot):
    here = f"http://127.0.0.1:{robot.url.port}"
    assert refused(robot, host="evil.example:8642") == 421
    assert refused(robot, token=False, origin="http://evil.example") == 403
    assert refused(robot, token="0" * 32, origin="http://evil.example") == 403
    assert refused(robot, token=False, origin="null") == 403
    assert refused(robot, token=False, origin=here) == 101  # any client on this machine may watch
    cookie = f"waymark_{robot.url.port}={robot.token}"
    assert refused(robot, token=False, origin="http://evil.example", Cookie=cookie) == 403  # a page of another site in the browser with the cookie
    status, headers, _ = robot.ask(f"/?token={robot.token}")
    assert status == 303 and headers["Location"] == "/" and headers["Set-Cookie"].startswith(cookie + ";") and "SameSite=Strict" in headers["Set-Cookie"]
    assert json.loads(robot.ask("/session.json")[2])["live"] is True
    for token, may in ((False, False), ("0" * 32, False), (True, True)):
        client = robot.client(token=token, origin=here)
        assert client.protocol == "waymark.v1"
        assert client.wait_for_op("control")["may"] is may
        client.send(op="order", order="go")
        if not may:
            assert "watch" in client.wait_for_op("status")["message"]
        else:
            client.wait_for_op("control", yours=True)
            client.send(op="release")
        client.close()
    with_cookie = robot.client(token=False, origin=here, Cookie=cookie)
    assert with_cookie.wait_for_op("control")["may"] is True
    with_cookie.close()


def one_in_control(robot):
    first, second = robot.client(), robot.client()
    first.watch_state()
    first.wait_for_phase("teaching")  # the order of access()
    first.send(op="order", order="stop")
    first.wait_for_phase("idle")
    second.send(op="order", order="go")
    assert "viewer" in second.wait_for_op("status")["message"]
    first.send(op="release")
    second.wait_for_op("control", held=False)
    second.send(op="take")
    second.wait_for_op("control", yours=True)
    second.close()
    first.wait_for_op("control", held=False)
    first.close()


def invalid_input(robot):
    client = robot.client()
    for payload in (b"", b"{", b"[[[[", b"\xff\xfe", b'{"op":"drive","speed_m_s":1e999,"yaw_rate_rad_s":0}', b'{"op":"subscribe","subscriptions":[{}]}'):
        client.send_frame(2, payload)
        try:
            client.send_frame(1, payload)
        except OSError:
            break  # invalid UTF-8 ends a connection (RFC 6455, section 8.1)
    client.close()
    client = robot.client()
    client.send_frame(1, b" " * 60000 + b"{}")  # close to the limit
    client.wait_for_op("status")
    try:
        client.socket.sendall(b"\x81\xff" + b"\0\0\0\1\0\0\0\0" + b"\0\0\0\0" + b"x" * 1000)  # claims 4 GiB
        client.wait_for(lambda _: False, 10)
    except (ConnectionError, OSError):
        pass
    client.close()
    many = []
    for _ in range(20):
        many.append(robot.client())
    full = 0
    for client in many:
        try:
            client.next()
        except ConnectionError:
            full += 1
        client.close()
    assert full == 4, full  # sixteen are served


def teaching_stops_replay_pauses(robot):
    """With the orders of the page; checked with the robot's state and odometry."""
    client, watcher = robot.client(), robot.client(token=False)
    for one in (client, watcher):
        one.watch_state()
    time.sleep(0.5)  # two presses within 0.3 s of robot time count as one
    client.send(op="order", order="go")
    watcher.wait_for_phase("teaching")
    state = watcher.wait_for_state(lambda s: "script" in s["commands"])
    assert state["page_drives"]
    client.send(op="order", order="script")
    watcher.subscribe("/odom", 1)
    speed = SpeedOf(watcher)
    speed.wait(lambda v: v > 0.1)
    client.close()  # the viewer in control disconnects
    speed.wait(lambda v: abs(v) < 0.005)
    for _ in range(50):
        assert abs(speed.next()) < 0.02
    client = robot.client()
    client.watch_state()
    client.send(op="take")
    with client.looked_at():
        speed.wait(lambda v: v > 0.1)  # a viewer is in control again: the script continues
        watcher.wait_for_phase("mapping", 120)
        watcher.wait_for_phase("ready", 120)
    client.send(op="order", order="go")
    watcher.wait_for_phase("replaying")
    speed.wait(lambda v: v > 0.1)
    # A client that is silent for more than three seconds counts as disconnected.
    watcher.wait_for_phase("paused", 20)
    speed.wait(lambda v: abs(v) < 0.005)
    client.send(op="order", order="go")
    watcher.wait_for_phase("replaying")
    speed.wait(lambda v: v > 0.1)
    client.send(op="order", order="stop")
    assert watcher.wait_for_phase("stopped")["reason"]
    speed.wait(lambda v: abs(v) < 0.005)
    client.close()
    watcher.close()


class SpeedOf:
    """Speed in nav_msgs/Odometry as CDR, subscription 1: the last 6 + 36 numbers of the message are twist and its covariance."""

    def __init__(self, client):
        self.client = client

    def next(self):
        message = self.client.wait_for(lambda m: isinstance(m, bytes) and struct.unpack("<I", m[1:5])[0] == 1)
        return struct.unpack("<d", message[-42 * 8:-41 * 8])[0]

    def wait(self, wanted, seconds=30):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if wanted(self.next()):
                return
        raise TimeoutError("the speed was not reached")


def never_reads(robot):
    lazy = [robot.client(receive_buffer=2048) for _ in range(4)]
    for client in lazy:
        client.watch_state()
        client.send(op="subscribe", subscriptions=[{"id": i, "channelId": i} for i in range(1, 6)])
    keen = robot.client(token=False)
    keen.watch_state()
    start = time.monotonic()
    for _ in range(20):
        keen.wait_for_state(lambda _: True)
    assert time.monotonic() - start < 15
    for client in (*lazy, keen):
        client.close()


def remote():
    with tempfile.TemporaryDirectory(prefix="waymark-live-") as folder, Robot(folder, "--listen", "0.0.0.0") as robot:
        assert robot.ask("/")[0] == 401 and robot.ask("/session.json")[0] == 401 and robot.ask("/session.json?token=" + "0" * 32)[0] == 401
        assert robot.ask(f"/session.json?token={robot.token}")[0] == 200
        assert robot.ask("/session.json", Cookie=f"waymark_{robot.url.port}={robot.token}")[0] == 200
        assert refused(robot, token=False) == 401
        assert refused(robot, host="robot.local:1", origin="http://robot.local:1") == 101
        assert refused(robot, host="robot.local:1", origin="http://evil.example:1", token=False) == 403
    for words in (["--token", "short"], ["--listen", "nowhere"], ["--driver", "page"]):
        flags = words if words[0] == "--driver" else ["--view", *words]
        done = subprocess.run([PROGRAM, "run", "--world", "circuit24", "-o", "/nowhere/at/all", *flags], capture_output=True, text=True, check=False, timeout=60)
        assert done.returncode == 2 and words[0] in done.stderr, done


def main():
    with tempfile.TemporaryDirectory(prefix="waymark-live-") as folder, Robot(folder, "--pace", "8") as robot:
        access(robot)
        one_in_control(robot)
        invalid_input(robot)
        teaching_stops_replay_pauses(robot)
        never_reads(robot)
    remote()
    print("live page: access, control, invalid input, disconnected viewers, clients that never read, remote")


if __name__ == "__main__":
    main()
