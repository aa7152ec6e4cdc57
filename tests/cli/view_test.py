#!/usr/bin/python3
"""`waymark view` over HTTP: the page, ranges, refused requests, hostile and slow clients, Ctrl-C.

usage: view_test.py PROGRAM
"""
import errno
import gzip
import http.client
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from made import LAP_OF_SQUARE, made  # noqa: E402

PROGRAM = sys.argv[1]


class Server:
    def __init__(self, *words):
        self.process = subprocess.Popen([PROGRAM, "view", *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.url = urllib.parse.urlsplit(self.process.stdout.readline().strip())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(timeout=20) == 0
        self.process.stdout.close()
        self.process.stderr.close()

    def ask(self, target, method="GET", **headers):
        connection = http.client.HTTPConnection(self.url.hostname, self.url.port, timeout=20)
        connection.request(method, target, headers={k.replace("_", "-"): v for k, v in headers.items()})
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer.status, dict(answer.getheaders()), body

    def raw(self, data):
        """The answer to these bytes, until the server closes the connection."""
        out = b""
        with socket.create_connection((self.url.hostname, self.url.port), timeout=20) as s:
            try:
                s.sendall(data)
                s.shutdown(socket.SHUT_WR)
                while piece := s.recv(65536):
                    out += piece
            except ConnectionError:
                pass  # the server closed the connection first
            except OSError as error:
                assert error.errno == errno.ENOTCONN
        return out


def ranges(server, data):
    session = json.loads(server.ask("/session.json")[2])
    names = [f["name"] for f in session["files"]]
    assert names == ["big.mcap", "small one.mcap", "map.yaml"], names
    assert session["files"][0]["size_bytes"] == len(data)
    url = "/" + session["files"][0]["url"]
    assert server.ask(url)[2] == data
    status, headers, body = server.ask(url, Range="bytes=1000-1299999")
    assert (status, body) == (206, data[1000:1300000])
    assert headers["Content-Range"] == f"bytes 1000-1299999/{len(data)}"
    status, headers, body = server.ask(url, method="HEAD")
    assert (status, headers["Content-Length"], body) == (200, str(len(data)), b"")
    assert server.ask(url, Range=f"bytes={len(data)}-")[0] == 416
    # One connection, many requests.
    connection = http.client.HTTPConnection(server.url.hostname, server.url.port, timeout=20)
    for first in range(0, 200000, 1000):
        connection.request("GET", url, headers={"Range": f"bytes={first}-{first + 9}"})
        assert connection.getresponse().read() == data[first:first + 10]
    connection.close()


def refusals(server):
    assert server.ask("/session.json", Host="evil.example")[0] == 421
    assert server.ask("/session.json", Origin="http://evil.example")[0] == 403
    assert server.ask("/", method="POST")[0] == 405
    for target in ("/files/3/x", "/files/0/../../../etc/passwd/../../..", "/../../etc/passwd", "/etc/passwd"):
        status, headers, body = server.ask(target)
        assert status in (200, 404) and b"root:" not in body, target
        assert headers["X-Content-Type-Options"] == "nosniff" and "default-src 'none'" in headers["Content-Security-Policy"]
    status, _, body = server.ask("/tags/tag36h11/7")
    assert status == 200 and len(json.loads(body)["cells"]) == 100


def hostile(server):
    for junk in (b"\0" * 100, b"GET / HTTP/1.1\r\nHost: " + b"a" * 20000 + b"\r\n\r\n", b"GET /" + b"../" * 5000 + b" HTTP/1.1\r\n\r\n",
                 b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n" + b"x" * 1000, b"GET / HTTP/1.1\r\nRange: bytes=", b"\x16\x03\x01", b""):
        assert len(server.raw(junk)) < 20000
    silent = [socket.create_connection((server.url.hostname, server.url.port)) for _ in range(40)]  # they send nothing
    greedy = socket.create_connection((server.url.hostname, server.url.port))  # requests, and never reads
    greedy.sendall(f"GET /files/0/x HTTP/1.1\r\nHost: 127.0.0.1:{server.url.port}\r\n\r\n".encode() * 20)
    assert server.ask("/session.json")[0] == 200
    for s in (*silent, greedy):
        s.close()
    assert server.ask("/session.json")[0] == 200


def page(server):
    status, headers, body = server.ask("/", Accept_Encoding="gzip")
    assert status == 200 and headers["Content-Type"].startswith("text/html")
    text = (gzip.decompress(body) if headers.get("Content-Encoding") == "gzip" else body).decode()
    if "notices.txt" in text:  # licences of packages in the page
        notices = gzip.decompress(server.ask("/notices.txt", Accept_Encoding="gzip")[2]).decode()
        assert all(name in notices for name in ("three ", "@mcap/core ", "uplot ")), notices[:200]
    assert "Waymark" in text
    assert "http://" not in text and "https://" not in text  # no resources of other hosts


def failures(folder):
    def run(*words):
        return subprocess.run([PROGRAM, "view", *map(str, words)], capture_output=True, text=True, check=False, timeout=60)
    (folder / "nothing.mcap").touch()
    (folder / "some.json").write_text("{}")
    for path, words in ((folder / "nothing.mcap", "nothing.mcap: "),
                        (folder / "some.json", "some.json: "),
                        (folder / "none.mcap", "none.mcap: "), (folder / "empty", "empty: "), (folder / "text.bag", "waymark convert")):
        done = run(path)
        assert done.returncode == 1 and words in done.stderr, done.stderr
    assert run("--port", "70000").returncode == 2


def listening_everywhere():
    with Server("--port", "0", "--listen", "0.0.0.0") as server:
        token = server.url.query
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
            try:
                s.connect(("192.0.2.1", 9))  # sends nothing; selects the address of this machine for outgoing traffic
                own = s.getsockname()[0]
            except OSError:
                own = None  # no network at all
        lines = []
        while own and not any(own in line for line in lines):
            lines.append(server.process.stderr.readline())
            assert lines[-1] and "Ctrl-C ends" not in lines[-1], lines
        if own:
            assert f" http://{own}:{server.url.port}/?{token}" in lines[-1], lines


def a_cut_recording(folder):
    data = (made(PROGRAM, *LAP_OF_SQUARE) / "lap.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(data[:len(data) // 2])
    with Server(folder / "cut.mcap", "--port", "0") as server:
        lines = []
        while "recover" not in "".join(lines):
            lines.append(server.process.stderr.readline())
            assert lines[-1] and "Ctrl-C ends" not in lines[-1], lines
        assert f"`waymark recover {folder / 'cut.mcap'} -o " in lines[-1], lines


def main():
    with tempfile.TemporaryDirectory(prefix="waymark-view-") as name:
        folder = pathlib.Path(name)
        served = folder / "served"
        (served / "map").mkdir(parents=True)
        (folder / "empty").mkdir()
        (folder / "text.bag").write_text("no recording")
        data = b"\x89MCAP0\r\n" + os.urandom(3_000_000)
        (served / "big.mcap").write_bytes(data)
        (served / "small one.mcap").write_bytes(data[:100])
        (served / "secret.txt").write_text("secret")
        (served / "map/map.yaml").write_text("format: waymark-map-1\n")
        with Server(served, "--port", "0") as server:
            ranges(server, data)
            refusals(server)
            hostile(server)
            page(server)
            with Server("--port", server.url.port) as other:  # the port is in use: another one is chosen
                assert other.url.port != server.url.port
                assert json.loads(other.ask("/session.json")[2]) == {"files": [], "live": False}
        failures(folder)
        listening_everywhere()
        a_cut_recording(folder)
    print("waymark view: ranges, refusals, hostile clients, the page, failures")


if __name__ == "__main__":
    main()
