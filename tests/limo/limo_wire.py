"""AgileX LIMO's serial protocol, written from the tables of its documentation only; it shares no code with waymark/robots/limo.

A frame has 14 bytes: 55 0E, message id, eight bytes of data, a counter, the sum of the data modulo 256; numbers are
big-endian. `Limo` is a robot on a pseudo-terminal that executes and records such frames.
"""
import math
import os
import select
import struct
import threading
import time
import tty

MOTION, MODE, STATE, FEEDBACK, ODOMETER, ACCELERATION, GYRO, ATTITUDE = 0x111, 0x421, 0x211, 0x221, 0x311, 0x321, 0x322, 0x323
LAYOUT = {MOTION: ">hhhh", MODE: ">BBB5x", STATE: ">BBHHBx", FEEDBACK: ">hhhh", ODOMETER: ">ii", ACCELERATION: ">hhh2x",
          GYRO: ">hhh2x", ATTITUDE: ">hhh2x"}


def pack(number, *values, count=0):
    data = struct.pack(LAYOUT[number], *values)
    return b"\x55\x0e" + struct.pack(">H", number) + data + bytes([count & 255, sum(data) & 255])


class Decoder:
    """Decodes a stream that should contain only frames; other bytes are counted in `torn`."""

    def __init__(self):
        self.rest = b""
        self.torn = 0

    def feed(self, received):
        self.rest += received
        frames = []
        while len(self.rest) >= 14:
            frame = self.rest[:14]
            if frame[:2] == b"\x55\x0e" and sum(frame[4:12]) & 255 == frame[13]:
                number = struct.unpack(">H", frame[2:4])[0]
                frames.append((number, struct.unpack(LAYOUT.get(number, ">8s"), frame[4:12])))
                self.rest = self.rest[14:]
            else:
                self.torn += 1
                self.rest = self.rest[1:]
        return frames


class Limo(threading.Thread):
    """A LIMO at the other end of `path`: it executes commands while it is in command mode, and records every received frame."""

    def __init__(self, drive=0, feedback_hz=50):
        super().__init__(daemon=True)
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)
        self.drive, self.period = drive, 1 / feedback_hz
        self.control_mode, self.vehicle_state, self.errors, self.battery = 0, 0, 0, 118
        self.obeys = True  # enters command mode on request
        self.speaks = True
        self.own_speed = 0  # by remote control
        self.spoil = lambda frame: frame
        self.frames = []  # (monotonic time, number, values)
        self.decoder = Decoder()
        self.x = self.y = self.yaw = self.speed = self.rate = 0.0
        self.cut = False
        self.start()

    def run(self):
        due = time.monotonic()
        while not self.cut:
            ready, _, _ = select.select([self.master], [], [], max(0, due - time.monotonic()))
            if ready:
                self.take(os.read(self.master, 4096))
            if time.monotonic() >= due:
                due += self.period
                self.move()
                if self.speaks:
                    self.send_feedback()
        os.close(self.slave)
        os.close(self.master)

    def take(self, received):
        now = time.monotonic()
        for number, values in self.decoder.feed(received):
            self.frames.append((now, number, values))
            if number == MODE and values[0] == 1 and self.obeys:
                self.control_mode = 1
            if number == MOTION and self.control_mode == 1:
                self.speed, self.rate = values[0] / 1e3, values[1] / 1e3

    def move(self):
        if self.control_mode != 1:
            self.speed, self.rate = self.own_speed, 0.0
        self.yaw += self.rate * self.period
        self.x += self.speed * math.cos(self.yaw) * self.period
        self.y += self.speed * math.sin(self.yaw) * self.period

    def send_feedback(self):
        degrees = math.degrees(math.remainder(self.yaw, 2 * math.pi))
        frames = [pack(ACCELERATION, 0, 0, 981), pack(GYRO, 0, 0, round(100 * math.degrees(self.rate))),
                  pack(ATTITUDE, round(100 * degrees), 0, 0),
                  pack(FEEDBACK, round(1e3 * self.speed), round(1e3 * self.rate), 0, 0),
                  pack(STATE, self.vehicle_state, self.control_mode, self.battery, self.errors, self.drive)]
        try:
            os.write(self.master, b"".join(self.spoil(frame) for frame in frames))
        except BlockingIOError:
            pass

    def cable_is_cut(self):
        self.cut = True
        self.join()

    def commands(self, since=0.0):
        """(time, speed [m/s], yaw rate [rad/s], lateral [m/s], steering in the message [rad]) of every 0x111 after `since`."""
        return [(at, *(value / 1e3 for value in values)) for at, number, values in list(self.frames) if number == MOTION and at > since]
