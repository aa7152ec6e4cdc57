"""LCM event logs, compared with Debian's liblcm event by event, and the conventions of MBot messages."""
import collections
import statistics
import struct
import subprocess
import unittest

import dumps

REAL = "lcm/lcmlog-2024-04-15.00"
POSE2D, TWIST2D, TAGS, IMU = 0x1f317af1246276ac, 0x85d72aee83523195, 0x815931ba2e0b44c2, 0x9ef39a5ffc75e462
ENCODERS, LIDAR = 0xaefa0bcd9e362081, 0x89dc5b879a5056cf


def event(number, micros, channel, payload):
    return struct.pack(">IqqII", 0xEDA1DA01, number, micros, len(channel), len(payload)) + channel.encode() + payload


def pose(utime, x, y, theta):
    return struct.pack(">Qqfff", POSE2D, utime, x, y, theta)


def tags(utime, found):
    return struct.pack(">Qqi", TAGS, utime, len(found)) + b"".join(
        struct.pack(">iq3f3f4f", number, 0, *position, *angles, *quaternion) for number, position, angles, quaternion in found)


def by_liblcm(path):
    done = subprocess.run([dumps.LCM_DUMP, path], capture_output=True, text=True, check=True)
    return [line.split("\t") for line in done.stdout.splitlines()]


class LcmLogs(dumps.InFolder):
    def write(self, *events):
        path = self.folder / "lcmlog"
        path.write_bytes(b"".join(events))
        return path

    def compare(self, path):
        log, lcm = dumps.Log(path).messages, by_liblcm(path)
        self.assertEqual(len(log), len(lcm))
        mismatches = sum((m.topic, m.time, m.size, m.crc) != (e[1], 1000 * int(e[2]), int(e[3]), int(e[4], 16))
                         for m, e in zip(log, lcm))
        self.assertEqual(mismatches, 0)
        return log

    def test_generated_log(self):
        path = self.write(*(event(i, 10**15 + 40_000 * i, "MBOT_ODOMETRY", pose(10**15 + 40_000 * i, i, 0, 0.1)) for i in range(50)))
        self.compare(path)
        samples = dumps.Log(path, "--samples").samples
        self.assertEqual(samples[3][:2], ["odometry", str((10**15 + 120_000) * 1000)])

    def test_speeds_are_joined_by_stamp_and_zero_stamps_become_receive_times(self):
        t = 10**15
        log = dumps.Log(self.write(
            event(0, t + 9, "MBOT_ODOMETRY", pose(t, 1, 2, 0.5)),
            event(1, t + 12, "MBOT_VEL_CMD", struct.pack(">Qqfff", TWIST2D, 0, 0.25, 0, 1)),
            event(2, t + 20, "MBOT_VEL", struct.pack(">Qqfff", TWIST2D, t, 0.5, 0, 0.25))), "--samples")
        self.assertEqual(log.samples, [["command", str((t + 12) * 1000), "0.2500000 1.0000000"],
                                       ["odometry", str(t * 1000), "1.0000000 2.0000000 0.5000000 0.5000000 0.2500000"]])
        self.assertEqual(log.problems["mbot.no_stamp:MBOT_VEL_CMD"].count, 1)

    def test_units_and_quaternion_order_are_determined_from_the_log(self):
        """A tag 1.5 m ahead, rotated 30 degrees about y: all conventions of publishers give the same sample."""
        s, c = 0.2588190, 0.9659258
        ways = {"jetson": ((100, 50, 1500), (0, 30, 0), (0, s, 0, c), {"mbot.millimetres", "mbot.quaternion_order"}),
                "pi5": ((100, 50, 1500), (0, 30, 0), (c, 0, s, 0), {"mbot.millimetres", "mbot.quaternion_order"}),
                "si": ((.1, .05, 1.5), (0, 0.5235988, 0), (c, 0, s, 0), {"mbot.quaternion_order"})}
        for name, (position, angles, quaternion, traps) in ways.items():
            with self.subTest(name):
                t = 10**15
                log = dumps.Log(self.write(*(event(i, t + i, "MBOT_APRILTAG_ARRAY", tags(t + i, [(7, position, angles, quaternion)]))
                                             for i in range(5))), "--samples")
                seen = log.samples[0][3].split()
                self.assertEqual(seen[0], "tagCustom48h12:7")
                for ours, true in zip(map(float, seen[1:]), (.1, .05, 1.5, 0, s, 0, c)):
                    self.assertAlmostEqual(ours, true, 5)
                self.assertEqual(int(log.samples[0][1]), t * 1000 - 65_000_000)  # its stamp is the time of publication
                self.assertLessEqual(traps, log.problems.keys())
                self.assertEqual("mbot.millimetres" in log.problems, "mbot.millimetres" in traps)

    def test_accelerometer_sign_is_determined_from_gravity(self):
        for z, flipped in ((-9.8, True), (9.8, False)):
            imu = struct.pack(">Qq3f3f3f3f4ff", IMU, 10**15, 0, 0, .1, 0, 0, z, *([0] * 3), *([0] * 3), 1, 0, 0, 0, 20)
            log = dumps.Log(self.write(event(0, 10**15, "MBOT_IMU", imu)), "--samples")
            self.assertTrue(log.samples[0][2].endswith("9.800000"), log.samples)
            self.assertNotIn("-9.8", log.samples[0][2])
            self.assertEqual("mbot.accelerometer_sign" in log.problems, flipped)

    def test_lidar_and_encoders(self):
        n = 4
        lidar = struct.pack(">Qqi", LIDAR, 10**15, n) + struct.pack(">4f", 1, 2, 3, 0) + struct.pack(">4f", 0, .1, .2, .3) + \
            struct.pack(">4q", *([0] * n)) + struct.pack(">4f", *([0] * n))
        encoders = struct.pack(">Qq3q3ii", ENCODERS, 10**15, 3120, -6240, 0, 0, 0, 0, 0)
        samples = dumps.Log(self.write(event(0, 10**15, "LIDAR", lidar), event(1, 10**15, "MBOT_ENCODERS", encoders)),
                            "--samples").samples
        self.assertEqual(samples[0][2], "4")
        self.assertEqual(samples[1][2], "6.283185307 12.566370614")

    def test_damage_is_skipped_and_reported_with_its_place(self):
        good = [event(i, 10**15 + i, "MBOT_ODOMETRY", pose(10**15 + i, i, 0, 0)) for i in range(20)]
        size = len(good[0])
        path = self.write(*good[:5], b"\xED\xA1\xDA\x01rubbish" * 3, *good[5:10], good[10][:7], *good[11:])
        log = dumps.Log(path)
        self.assertEqual(len(log.messages), 19)
        self.assertEqual(log.problems["lcm.resync"].count, 2)
        self.assertIn(str(5 * size), log.problems["lcm.resync"].words)
        self.assertEqual(log.problems["lcm.missing_events"].count, 1)
        for cut in range(1, size):
            log = dumps.Log(self.write(*good[:3], good[3][:cut]))
            self.assertEqual(len(log.messages), 3)
            self.assertIn(str(3 * size), log.problems["lcm.cut"].words)

    def test_real_log_matches_liblcm(self):
        path = dumps.real_data(REAL)
        log = self.compare(path)
        self.assertEqual(len(log), 37_992)
        counts = collections.Counter(m.topic for m in log)
        self.assertEqual(counts, {"MBOT_ODOMETRY": 4535, "MBOT_IMU": 4535, "MBOT_APRILTAG_ARRAY": 6774, "MBOT_VEL": 4535,
                                  "MBOT_MOTOR_VEL": 4535, "MBOT_MOTOR_PWM": 4535, "MBOT_ENCODERS": 4535, "MBOT_VEL_CMD": 3640,
                                  "MBOT_TIMESYNC": 184, "SLAM_STATUS": 184})
        for topic, rate, median_ms in (("MBOT_ODOMETRY", 24.64, 40.3), ("MBOT_APRILTAG_ARRAY", 36.81, 26.4),
                                       ("MBOT_VEL_CMD", 19.78, 50.5)):
            times = [m.time for m in log if m.topic == topic]
            self.assertAlmostEqual((len(times) - 1) / (times[-1] - times[0]) * 1e9, rate, delta=0.02)
            self.assertAlmostEqual(statistics.median(b - a for a, b in zip(times, times[1:])) * 1e-6, median_ms, delta=0.1)
        self.assertAlmostEqual((log[-1].time - log[0].time) * 1e-9, 183.98, delta=0.1)
        print("37992 events, 0 mismatches")

    def test_real_log_gives_golden_samples(self):
        log = dumps.Log(dumps.real_data(REAL), "--samples")
        counts = collections.Counter(s[0] for s in log.samples)
        self.assertEqual(counts, {"odometry": 4535, "imu": 4535, "tag_poses": 6774, "command": 3640, "wheels": 4535})
        self.assertEqual(sum(s[0] == "tag_poses" and s[2] == "0" for s in log.samples), 1668)
        first = next(s for s in log.samples if s[0] == "tag_poses")
        self.assertEqual([t.split()[0] for t in first[3:]], [f"tagCustom48h12:{i}" for i in (1, 2, 10, 20)])
        for ours, true in zip(first[3].split()[1:4], (-0.25701178, 0.048850803, 1.6352969)):
            self.assertAlmostEqual(float(ours), true, 7)
        last = [s for s in log.samples if s[0] == "odometry"][-1][2].split()
        for ours, true in zip(last, (1.1347898, -0.1394672, 1.6695906)):
            self.assertAlmostEqual(float(ours), true, 6)
        for key, count in {"mbot.millimetres": 18_710, "mbot.publish_stamps": 6774, "mbot.no_stamp:MBOT_VEL_CMD": 3640,
                           "mbot.no_stamp:MBOT_MOTOR_VEL": 4535, "mbot.accelerometer_sign": 4535,
                           "mbot.quaternion_order": 18_710}.items():
            self.assertEqual((key, log.problems[key].count), (key, count))
        self.assertIn("x, y, z, w", log.problems["mbot.quaternion_order"].words)
        self.assertFalse([p for p in log.problems.values() if p.kind == "damage"])

    def test_speeds_of_the_real_log_integrate_to_its_poses(self):
        """The speed with the stamp of a pose is the mean over the preceding interval."""
        import math
        odometry = [(int(s[1]), *map(float, s[2].split())) for s in
                    dumps.Log(dumps.real_data(REAL), "--samples").samples if s[0] == "odometry"]
        errors = []
        for (t0, x0, y0, a0, *_), (t1, x1, y1, _, v, w) in zip(odometry, odometry[1:]):
            dt = (t1 - t0) * 1e-9
            middle = a0 + w * dt / 2
            errors.append(math.hypot(x0 + v * dt * math.cos(middle) - x1, y0 + v * dt * math.sin(middle) - y1))
        self.assertLess(math.sqrt(statistics.fmean(e * e for e in errors)), 0.3e-3)


if __name__ == "__main__":
    dumps.main()
