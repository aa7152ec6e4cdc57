"""Faults by script: KIND@START or KIND@START:DURATION, seconds since the plant was switched on."""
import dataclasses
import math

KINDS = {
    "stuck_feed": "the last scene comes again and again with fresh noise",
    "camera_unplugged": "no images",
    "dark": "images without light",
    "held": "the robot is held, its wheels turn",
    "blocked": "the wheels do not turn",
    "spinning": "the wheels turn and find hardly any grip",
    "carried_slowly": "the robot is carried sideways at 3 cm/s",
    "carried": "the robot is carried 0.45 m within half a second",
    "encoder_stuck": "the encoders stand still",
    "gyro_stuck": "the gyro repeats its last value",
    "clock_jump": "all stamps go on by half a second",
    "latency": "images come 0.3 s later and are stamped when they come",
    "gain_step": "another floor: the robot turns by 30 %% less",
}


@dataclasses.dataclass(frozen=True)
class Fault:
    kind: str
    start_s: float
    duration_s: float = math.inf

    def active(self, time_s: float) -> bool:
        return self.start_s <= time_s < self.start_s + self.duration_s


def parse(text: str) -> Fault:
    kind, _, times = text.partition("@")
    start, _, duration = times.partition(":")
    if kind not in KINDS:
        raise ValueError(f"unknown fault {kind!r}; known: {', '.join(KINDS)}")
    return Fault(kind, float(start), float(duration) if duration else math.inf)


def carried(faults: list[Fault], time_s: float) -> tuple[float, float]:
    """Total displacement in the world of the robot, or of the floor under its wheels, x and y [m]."""
    x = y = 0.0
    for fault in faults:
        since = min(max(0.0, time_s - fault.start_s), fault.duration_s)
        if fault.kind == "carried_slowly":
            y += 0.03 * since
        elif fault.kind == "carried":
            x += 0.45 * min(1.0, since / 0.5)
    return x, y
