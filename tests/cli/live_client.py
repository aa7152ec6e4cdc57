"""A small WebSocket client (RFC 6455) for tests: it needs no package and can send invalid data."""
import base64
import contextlib
import json
import os
import socket
import struct
import threading
import time


class Refused(Exception):
    """The server did not upgrade; args[0] is the status."""


class Client:
    def __init__(self, url, protocol="waymark.v1", target="/live", origin=None, host=None, receive_buffer=None, **headers):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(20)
        self.socket.connect((url.hostname, url.port))
        fields = {"Host": host or f"{url.hostname}:{url.port}", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                  "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(), "Sec-WebSocket-Protocol": protocol, **headers}
        if origin is not None:
            fields["Origin"] = origin
        self.socket.sendall((f"GET {target} HTTP/1.1\r\n" + "".join(f"{k}: {v}\r\n" for k, v in fields.items()) + "\r\n").encode())
        self.bytes = b""
        while b"\r\n\r\n" not in self.bytes:
            piece = self.socket.recv(4096)
            if not piece:
                raise Refused(0)
            self.bytes += piece
        head, self.bytes = self.bytes.split(b"\r\n\r\n", 1)
        self.status = int(head.split()[1])
        if self.status != 101:
            self.socket.close()
            raise Refused(self.status)
        lines = [line.split(": ", 1) for line in head.decode().split("\r\n")[1:]]
        self.channels = {}
        self.lock = threading.Lock()
        self.protocol = next((v for k, v in lines if k.lower() == "sec-websocket-protocol"), None)

    def close(self):
        self.socket.close()

    def send_frame(self, opcode, payload):
        mask = os.urandom(4)
        size = bytes([0x80 | len(payload)]) if len(payload) < 126 else b"\xfe" + struct.pack(">H", len(payload))
        with self.lock:
            self.socket.sendall(bytes([0x80 | opcode]) + size + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def send(self, **message):
        self.send_frame(1, json.dumps(message).encode())

    def _take(self, count):
        while len(self.bytes) < count:
            piece = self.socket.recv(65536)
            if not piece:
                raise ConnectionError("the server closed the connection")
            self.bytes += piece
        taken, self.bytes = self.bytes[:count], self.bytes[count:]
        return taken

    def next(self, seconds=20):
        """The next text as an object, or the next binary frame as bytes; pings are answered."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            first, size = self._take(2)
            if size == 126:
                size = struct.unpack(">H", self._take(2))[0]
            elif size == 127:
                size = struct.unpack(">Q", self._take(8))[0]
            payload = self._take(size)
            if first & 15 == 9:
                self.send_frame(10, payload)
            elif first & 15 == 8:
                raise ConnectionError("closed")
            elif first & 15 == 1:
                message = json.loads(payload)
                for channel in message.get("channels", []):
                    self.channels[channel["topic"]] = channel["id"]
                return message
            elif first & 15 == 2:
                return payload
        raise TimeoutError("only pings arrived")

    def wait_for(self, wanted, seconds=20):
        """The first message for which wanted() holds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = self.next()
            if wanted(message):
                return message
        raise TimeoutError("the message did not arrive")

    def wait_for_op(self, op, **fields):
        return self.wait_for(lambda m: isinstance(m, dict) and m.get("op") == op and all(m.get(k) == v for k, v in fields.items()))

    def subscribe(self, topic, subscription):
        while topic not in self.channels:
            self.next()
        self.send(op="subscribe", subscriptions=[{"id": subscription, "channelId": self.channels[topic]}])

    def watch_state(self):
        """Subscribes to the state; wait_for_phase() works from then on."""
        self.subscribe("/waymark/state", 7000)

    @contextlib.contextmanager
    def looked_at(self):
        """Reports the viewer as present, like the page, until the end of the block."""
        over = threading.Event()

        def talk():
            while not over.wait(0.3):
                self.send(op="alive")

        thread = threading.Thread(target=talk)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def wait_for_state(self, wanted, seconds=20):
        def is_it(message):
            return isinstance(message, bytes) and struct.unpack("<I", message[1:5])[0] == 7000 and wanted(json.loads(message[13:]))
        return json.loads(self.wait_for(is_it, seconds)[13:])

    def wait_for_phase(self, phase, seconds=20):
        return self.wait_for_state(lambda state: state["phase"] == phase, seconds)
