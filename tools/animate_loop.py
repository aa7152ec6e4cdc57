#!/usr/bin/python3
"""Draws the animation of README.md: a lap taught, mapped and replayed, from the files of one `waymark demo`.

usage: tools/animate_loop.py PROGRAM DEMO_FOLDER OUT.svg      DEMO_FOLDER: has lap.mcap, map/ and replay.mcap

The taught lap is drawn by odometry as the robot drives it, turns into the optimised trajectory, and the replayed lap (ground truth of the
simulator) is drawn over it. The animation is SVG with SMIL and needs no script.
"""
import math
import pathlib
import re
import subprocess
import sys
import tempfile

POINTS = 160  # of each drawn path
TEACH, MAP, REPLAY, REST = 5.0, 1.5, 5.0, 1.5  # seconds of the animation
TOTAL = TEACH + MAP + REPLAY + REST
BLUE, ORANGE, GREEN, GREY = "#2a6fdb", "#d9822b", "#1a8f4c", "#8a8f98"


def poses(program, recording, topic):
    """(t, x, y, yaw) of a topic of poses."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "poses.tum"
        subprocess.run([program, "convert", recording, out, "--topics", topic], check=True, capture_output=True)
        return read_tum(out)


def read_tum(path):
    rows = []
    for line in path.read_text().splitlines():
        if line and not line.startswith("#"):
            t, x, y, _, qx, qy, qz, qw = map(float, line.split()[:8])
            rows.append((t, x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))))
    return rows


def resampled(rows):
    """POINTS rows, evenly spaced in time."""
    step = (len(rows) - 1) / (POINTS - 1)
    return [rows[round(i * step)] for i in range(POINTS)]


def placed(rows, start):
    """Rows of odometry, which may start at any pose, transformed so that the first one is `start`."""
    _, x0, y0, a0 = rows[0]
    _, x1, y1, a1 = start
    c, s = math.cos(a1 - a0), math.sin(a1 - a0)
    return [(t, x1 + c * (x - x0) - s * (y - y0), y1 + s * (x - x0) + c * (y - y0), a + a1 - a0) for t, x, y, a in rows]


def tags(map_file):
    """(id, x, y, direction of the tag's plane) of every tag of map.yaml."""
    text = map_file.read_text()
    found = []
    for tag, x, y, q in re.findall(r'- tag: "[^:]+:(\d+)".*?position_m: \[([^,]+), ([^,]+),[^\]]*\]\s+quaternion_xyzw: \[([^\]]+)\]', text, re.S):
        qx, qy, qz, qw = map(float, q.split(","))
        right = (1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qw * qz))  # x axis of the tag, seen from above
        found.append((int(tag), float(x), float(y), math.atan2(right[1], right[0])))
    return found


class Page:
    """Converts metres of the map, x right and y up, to units of the image."""

    def __init__(self, points, width=760, margin=34):
        xs, ys = [p[0] for p in points], [p[1] for p in points]
        self.scale = (width - 2 * margin) / (max(xs) - min(xs))
        self.x0, self.y1, self.margin = min(xs), max(ys), margin
        self.width, self.height = width, (max(ys) - min(ys)) * self.scale + 2 * margin + 40

    def at(self, x, y):
        return self.margin + (x - self.x0) * self.scale, 40 + self.margin + (self.y1 - y) * self.scale

    def path(self, rows):
        return "M" + " L".join("{:.1f} {:.1f}".format(*self.at(x, y)) for _, x, y, _ in rows)


def times(*seconds):
    return ";".join(f"{s / TOTAL:.4f}" for s in seconds)


def animate(attribute, values, seconds):
    return (f'<animate attributeName="{attribute}" values="{";".join(map(str, values))}" keyTimes="{times(*seconds)}" '
            f'dur="{TOTAL}s" repeatCount="indefinite"/>')


def trail(page, rows, colour, begin, end, more="", dash=""):
    """A path that is drawn from begin to end and remains visible."""
    d = page.path(rows)
    values, seconds = ([1, 1, 0, 0], [0, begin, end, TOTAL]) if begin > 0 else ([1, 0, 0], [0, end, TOTAL])
    return (f'<path d="{d}" pathLength="1" stroke-dasharray="1" fill="none" stroke="{colour}" stroke-width="3" {dash}>'
            f'{animate("stroke-dashoffset", values, seconds)}{more}</path>')


def robot(page, rows, colour, begin, end):
    """A triangle that drives along rows from begin to end; invisible before and after."""
    where = ";".join("{:.1f} {:.1f}".format(*page.at(x, y)) for _, x, y, _ in rows)
    unwrapped, last = [], 0.0
    for *_, yaw in rows:
        last += math.remainder(-math.degrees(yaw) - last, 360)
        unwrapped.append(f"{last:.0f}")
    steps = [begin + (end - begin) * i / (len(rows) - 1) for i in range(len(rows))]
    keys = times(*([0] if begin > 0 else []), *steps, *([TOTAL] if end < TOTAL else []))
    hold = lambda values: ";".join(([values[0]] if begin > 0 else []) + values + ([values[-1]] if end < TOTAL else []))  # noqa: E731
    shown, at = ([0, 1, 0, 0], [0, begin, end, TOTAL]) if begin > 0 else ([1, 0, 0], [0, end, TOTAL])
    common = f'keyTimes="{keys}" dur="{TOTAL}s" repeatCount="indefinite"'
    return (f'<g><animateTransform attributeName="transform" type="translate" values="{hold(where.split(";"))}" {common}/>'
            f'<g><animateTransform attributeName="transform" type="rotate" values="{hold(unwrapped)}" {common}/>'
            f'<path d="M13 0 L-9 8 L-9 -8 Z" fill="{colour}" stroke="white" stroke-width="1.5">'
            f'<animate attributeName="opacity" calcMode="discrete" values="{";".join(map(str, shown))}" keyTimes="{times(*at)}" '
            f'dur="{TOTAL}s" repeatCount="indefinite"/></path></g></g>')


def caption(text, begin, end):
    shown = [(0, 0)] * (begin > 0) + [(begin, 1), (end, 0), (TOTAL, 0)]
    shown = [pair for i, pair in enumerate(shown) if i == 0 or pair[0] > shown[i - 1][0]]
    return (f'<text x="34" y="34" opacity="0">{text}<animate attributeName="opacity" calcMode="discrete" '
            f'values="{";".join(str(v) for _, v in shown)}" keyTimes="{times(*[s for s, _ in shown])}" dur="{TOTAL}s" '
            f'repeatCount="indefinite"/></text>')


def first_near(rows, x, y, reach_m=2.5):
    """The first time (0 to 1) at which a robot on rows has a place in front of it and within reach."""
    for i, (_, rx, ry, yaw) in enumerate(rows):
        ahead = math.atan2(y - ry, x - rx) - yaw
        if math.hypot(x - rx, y - ry) < reach_m and abs(math.remainder(ahead, 2 * math.pi)) < 0.6:
            return i / (len(rows) - 1)
    return 1.0


def image(program, demo):
    solved = resampled(read_tum(demo / "map/trajectory.txt"))
    driven = placed(resampled(poses(program, demo / "lap.mcap", "/odom")), solved[0])
    replayed = resampled(poses(program, demo / "replay.mcap", "/truth/pose"))
    placed_tags = tags(demo / "map/map.yaml")
    page = Page([(x, y) for _, x, y, _ in driven + solved] + [(x, y) for _, x, y, _ in placed_tags])
    mapped, start = TEACH + MAP, TEACH + 0.2
    bend = (f'<animate attributeName="d" values="{";".join([page.path(driven)] * 2 + [page.path(solved)] * 2)}" '
            f'keyTimes="{times(0, start, mapped, TOTAL)}" dur="{TOTAL}s" repeatCount="indefinite"/>')
    colour = animate("stroke", [ORANGE, ORANGE, BLUE, BLUE], [0, start, mapped, TOTAL])
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {page.width} {page.height:.0f}" font-family="sans-serif" font-size="19">',
             f'<rect width="100%" height="100%" fill="white"/>', trail(page, driven, ORANGE, 0, TEACH, bend + colour)]
    for _, x, y, along in placed_tags:
        px, py = page.at(x, y)
        seen = max(0.01, TEACH * first_near(solved, x, y))
        dx, dy = 9 * math.cos(along), -9 * math.sin(along)
        parts.append(f'<line x1="{px - dx:.1f}" y1="{py - dy:.1f}" x2="{px + dx:.1f}" y2="{py + dy:.1f}" stroke="{GREY}" stroke-width="5">'
                     f'{animate("opacity", [0.15, 0.15, 1, 1], [0, seen, seen + 0.15, TOTAL])}'
                     f'{animate("stroke", [GREY, GREY, "#111", "#111"], [0, start, mapped, TOTAL])}</line>')
    parts += [trail(page, replayed, GREEN, mapped, mapped + REPLAY), robot(page, driven, ORANGE, 0, TEACH),
              robot(page, replayed, GREEN, mapped, mapped + REPLAY),
              caption("Teach: a person drives a lap; odometry drifts", 0, TEACH),
              caption("Map: tags and trajectory are optimised", TEACH, mapped),
              caption("Replay: the robot drives the lap by itself", mapped, TOTAL), "</svg>"]
    return "\n".join(parts) + "\n"


def main():
    if len(sys.argv) != 4:
        print(__doc__)
        return 2
    pathlib.Path(sys.argv[3]).write_text(image(sys.argv[1], pathlib.Path(sys.argv[2])), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
