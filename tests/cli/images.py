"""Images for tests of the command line: upright tags with cells of whole pixels, so that their true corners are whole numbers."""
import base64
import functools
import pathlib
import struct
import tempfile
import zlib

TAGS = {
    ("tag36h11", 7): """..........
.########.
.####.###.
.####..##.
.##.#.###.
.#.#...##.
.####...#.
.##.#.###.
.########.
..........""",
    ("tag36h11", 42): """..........
.########.
.#..#.###.
.#.#.##.#.
.#####.##.
.#.#.#.##.
.##...#.#.
.#...#..#.
.########.
..........""",
    ("tag16h5", 3): """........
.######.
.##.###.
.##.#.#.
.#.#..#.
.#.##.#.
.######.
........""",
}
WHITE, BLACK = 220, 30

# 64 x 64 px of one grey, four components, written by ImageMagick.
CMYK_JPEG = base64.b64decode(
    "/9j/7gAOQWRvYmUAZAAAAAAC/9sAQwAbEhQXFBEbFxYXHhwbIChCKyglJShROj0wQmBVZWRfVV1baniZgWpxkHNbXYW1hpCeo6ut"
    "q2eAvMm6pseZqKuk/9sAQwEcHh4oIyhOKytOpG5dbqSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSk"
    "pKSkpKSk/8AAFAgAQABABAEiAAIRAQMRAQQiAP/EABUAAQEAAAAAAAAAAAAAAAAAAAAG/8QAFBABAAAAAAAAAAAAAAAAAAAAAP/E"
    "ABQBAQAAAAAAAAAAAAAAAAAAAAD/xAAUEQEAAAAAAAAAAAAAAAAAAAAA/9oADgQBAAIRAxEEAAA/AJkAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAB/9k=")


def scene(width, height, tags):
    """Grey rows; tags = [(family, id, x, y, cell)] with x and y of the top left corner of the black square, all in pixels."""
    rows = [bytearray([WHITE - (x * 7 + y * 3) % 23 for x in range(width)]) for y in range(height)]
    for family, number, x, y, cell in tags:
        for r, line in enumerate(TAGS[family, number].splitlines()):
            for c, mark in enumerate(line):
                value = WHITE if mark == "." else BLACK
                for py in range(y + (r - 1) * cell, y + r * cell):
                    for px in range(x + (c - 1) * cell, x + c * cell):
                        rows[py][px] = value
    return rows


def corners(family, number, x, y, cell):
    """TL, TR, BR, BL as a flat list."""
    side = (len(TAGS[family, number].splitlines()) - 2) * cell
    return [x, y, x + side, y, x + side, y + side, x, y + side]


def write_pgm(path, rows):
    header = f"P5\n{len(rows[0])} {len(rows)}\n255\n".encode()
    pathlib.Path(path).write_bytes(header + b"".join(rows))


def write_pgm16(path, rows):
    header = f"P5\n{len(rows[0])} {len(rows)}\n65535\n".encode()
    pathlib.Path(path).write_bytes(header + b"".join(struct.pack(">H", v * 257) for row in rows for v in row))


def write_ppm(path, rows):
    header = f"P6\n{len(rows[0])} {len(rows)}\n255\n".encode()
    pathlib.Path(path).write_bytes(header + b"".join(bytes([v, v, v]) for row in rows for v in row))


def write_png(path, rows, depth=8):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), depth, 0, 0, 0, 0)
    if depth == 16:
        rows = [b"".join(struct.pack(">H", v * 257) for v in row) for row in rows]
    data = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows))
    pathlib.Path(path).write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


SCENE_TAGS = [("tag36h11", 7, 40, 50, 6), ("tag36h11", 42, 180, 90, 10)]


def truth_csv(images):
    """images = {name: tags}"""
    lines = ["image,family,id,x0,y0,x1,y1,x2,y2,x3,y3"]
    for name, tags in images.items():
        lines += [",".join(map(str, [name, tag[0], tag[1], *corners(*tag)])) for tag in tags] or [name + "," * 10]
    return "\n".join(lines) + "\n"


CAMERA = """image_width: 320
image_height: 240
camera_name: test
camera_matrix: {rows: 3, cols: 3, data: [300, 0, 159.5, 0, 300, 119.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""


def draw(folder):
    (folder / "photos").mkdir()
    rows = scene(320, 240, SCENE_TAGS)
    write_png(folder / "photograph.png", rows)
    write_png(folder / "photos/0001.png", rows)
    write_pgm(folder / "photos/0002.pgm", scene(320, 240, SCENE_TAGS[:1]))
    write_ppm(folder / "photos/0003.ppm", scene(320, 240, []))
    images = {"photograph": SCENE_TAGS, "0001": SCENE_TAGS, "0002": SCENE_TAGS[:1], "0003": []}
    (folder / "truth.csv").write_text(truth_csv(images))
    (folder / "camera.yaml").write_text(CAMERA)


@functools.cache
def drawn():
    """{name: bytes}, once for all tests of a process."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        draw(folder)
        return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def fill(folder):
    """Writes the files that commands in the docs use: photograph.png with two tags, truth.csv, and a folder photos/."""
    for name, data in drawn().items():
        path = pathlib.Path(folder) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
