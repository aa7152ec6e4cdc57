"""Compares two versions of a file or stream field by field: text, CSV, YAML, JSON, SVG, HTML, PDF, PNG, SQLite and MCAP (see same_bytes.py).

A reader turns a file into a tree of dictionaries, lists, strings and numbers; compare() walks two trees. Unreadable files are compared as bytes.
"""
import collections
import ctypes
import dataclasses
import difflib
import functools
import hashlib
import json
import math
import re
import sqlite3
import struct
import tempfile
import zlib

NUMBER = re.compile(r"((?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.]*\d)|(?<!\w)[-+]?(?:nan|inf|NaN|Infinity)(?!\w))")
# Fields that describe the run and not the result.
MASKS = [
    (re.compile(r'("(?:wall_s|peak_rss_mib)": *)[-+.\deE]+'), r"\g<1>0"),
    (re.compile(r"/CreationDate ?\([^)]*\)"), "/CreationDate ()"),
]


@dataclasses.dataclass
class Rules:
    """The tolerance of numbers, and renamed words. absolute: a rounding error around zero."""
    relative: float = 0.0
    rename: object = str  # a function of a text; this one changes nothing
    renames: bool = False
    renamed: bool = False  # in the file that is being compared, so that paragraphs may be wrapped elsewhere
    accepted: collections.Counter = dataclasses.field(default_factory=collections.Counter)
    rounded: list = dataclasses.field(default_factory=list)
    largest: tuple = (0.0, "")  # relative difference that was accepted, and its field
    worst: tuple = (0.0, "")  # and one that was not

    @property
    def absolute(self):
        return 1e-6 * self.relative

    def touches(self, data):
        """Whether a rename changes something in these bytes."""
        return self.renames and self.rename(text := data.decode("latin-1")) != text


@dataclasses.dataclass(frozen=True)
class Difference:
    field: str
    before: str
    after: str


class Packed:
    """Bytes that are parsed only if they differ."""

    def __init__(self, data, read):
        self.data, self.read = data, read


def masked(text, places=()):
    """The text without fields that describe the run and without its folders: {folder: word}."""
    for folder in places:
        text = text.replace(folder, places[folder])
    for pattern, replacement in MASKS:
        text = pattern.sub(replacement, text)
    return text


def same_number(before, after, rules, field, printed=False):
    """Whether two numbers are equal within the tolerance; counts and integers must be equal. printed: may be rounded to few decimals."""
    if all(re.fullmatch(r"[-+]?\d+", str(value)) for value in (before, after)):
        return int(before) == int(after)
    a, b = float(before), float(after)
    if a == b or (math.isnan(a) and math.isnan(b)):
        return True
    if not (math.isfinite(a) and math.isfinite(b)):
        return False
    apart = abs(a - b)
    share = apart / max(abs(a), abs(b))
    if rules.relative > 0 and apart <= max(rules.relative * max(abs(a), abs(b)), rules.absolute):
        if apart > rules.absolute:
            rules.largest = max(rules.largest, (share, field))
        rules.accepted["numbers within the tolerance"] += 1
        return True
    digits = [len(str(value).partition(".")[2]) for value in (before, after)]
    if rules.relative > 0 and printed and 0 < digits[0] == digits[1] <= 6 and "e" not in f"{before}{after}".lower() and apart < 1.01 * 10.0 ** -digits[0]:
        rules.accepted["numbers rounded to the neighbouring last digit"] += 1
        rules.rounded.append(f"{field}: {before} -> {after}")
        return True
    rules.worst = max(rules.worst, (share, field))
    return False


def same_words(before, after, rules, field):
    """Whether two texts are equal word by word, numbers within the tolerance, regardless of spaces."""
    one, other = ([part for part in NUMBER.split(" ".join(text.split())) if part.strip()] for text in (before, after))
    return len(one) == len(other) and all(
        a.strip() == b.strip() or (NUMBER.fullmatch(a) and NUMBER.fullmatch(b) and same_number(a, b, rules, field, printed=True))
        for a, b in zip(one, other))


def compare_text(field, before, after, rules):
    """Compares line by line. Spaces may differ only if numbers may differ or words were renamed."""
    old, new = before.split("\n"), after.split("\n")
    same_length = len(old) == len(new)
    if not same_length and len(old) + len(new) > 4000:  # too many to find the lines that correspond
        at = next((i for i, (a, b) in enumerate(zip(old, new)) if a != b), min(len(old), len(new)) - 1)
        yield Difference(f"{field} lines from {at + 1} on".strip(), f"{len(old)} lines, {old[at]}", f"{len(new)} lines, {new[at]}")
        return
    blocks = [("replace", i, i + 1, i, i + 1) for i in range(len(old)) if old[i] != new[i]] if same_length else \
        [block for block in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes() if block[0] != "equal"]
    for _, i, j, k, m in joined(blocks) if rules.renamed else blocks:
        place = f"{field} line {i + 1}".strip() if j - i <= 1 else f"{field} lines {i + 1}-{j}".strip()
        pairs = [(old[i:j], new[k:m])] if j - i != m - k or rules.renamed else [([a], [b]) for a, b in zip(old[i:j], new[k:m])]
        for a, b in pairs:
            one, other = "\n".join(a), "\n".join(b)
            if not ((rules.relative > 0 or rules.renamed) and same_words(one, other, rules, place)):
                yield Difference(place, one, other)


def joined(blocks):
    """Joins consecutive lines into blocks, because words move between lines when a paragraph is wrapped differently."""
    done = []
    for block in blocks:
        if done and block[1] == done[-1][2] and block[3] == done[-1][4]:
            done[-1] = ("replace", done[-1][1], block[2], done[-1][3], block[4])
        else:
            done.append(block)
    return done


def compare(field, before, after, rules):
    """The differences of two trees, with the path of each."""
    kinds = (type(before), type(after))
    if Packed in kinds and kinds[0] is kinds[1]:
        if before.data != after.data or rules.touches(before.data):
            yield from compare(field, before.read(before.data), after.read(after.data), rules)
    elif kinds == (dict, dict):
        old = {rules.rename(str(key)): value for key, value in before.items()}
        new = {str(key): value for key, value in after.items()}
        for key in [*old, *(key for key in new if key not in old)]:
            path = f"{field}.{key}" if field else key
            yield from compare(path, old[key], new[key], rules) if key in old and key in new else \
                [Difference(path, shown(old.get(key, "absent")), shown(new.get(key, "absent")))]
    elif kinds == (list, list):
        if len(before) != len(after):
            yield Difference(f"{field}.length", str(len(before)), str(len(after)))
        for index, (a, b) in enumerate(zip(before, after)):
            yield from compare(f"{field}[{index}]", a, b, rules)
    elif kinds == (str, str):
        before = rules.rename(before)
        if before != after:
            yield from compare_text(field, before, after, rules) if "\n" in before + after or rules.relative > 0 or not field else \
                [Difference(field, before, after)]
    elif bool not in kinds and all(issubclass(kind, (int, float)) for kind in kinds):
        if not same_number(before, after, rules, field, printed=True):
            yield Difference(field, repr(before), repr(after))
    elif before != after or kinds[0] is not kinds[1]:
        yield Difference(field, shown(before), shown(after))


def shown(value):
    return f"{len(value.data)} bytes" if isinstance(value, Packed) else str(value)


def differences(name, before, after, rules, places=((), ())):
    """The differences of a file or stream of this name; empty if the bytes are equal. places: the masked folders of each."""
    accepted = sum(rules.accepted.values())
    binary = next((read for suffix, read in BINARY.items() if name.endswith(suffix)), None)
    if binary is None and is_text(before) and is_text(after):
        one, other = (masked(data.decode("utf-8", "replace"), folders) for data, folders in zip((before, after), places))
        rules.renamed = rules.rename(one) != one
        one = rules.rename(one)
        if one == other:
            return []
        read = read_text_of(name, one, other)
        found, layout = list(compare("", read(one), read(other), rules)), read is not as_is
    else:
        if before == after and not rules.renames:
            return []
        rules.renamed = rules.renames
        read = binary or (lambda data: {"content": as_hash(data)})
        found, layout = list(compare("", read(before), read(after), rules)), True
    if not found and layout and not rules.renamed and sum(rules.accepted.values()) == accepted:
        return [Difference("layout", f"{len(before)} bytes with the same fields", f"{len(after)} bytes")]
    return found


def is_text(data):
    return b"\0" not in data


def as_is(text):
    return text


def read_text_of(name, *texts):
    """The reader of a text: JSON also on a stream, as one document or one per line; markup is split at its tags."""
    for read in (json.loads, json_lines):
        try:
            if all(isinstance(item, dict) for text in texts for item in (read(text) if read is json_lines else [read(text)])):
                return read
        except ValueError:
            continue
    return (lambda text: text.replace(">", ">\n")) if name.endswith((".svg", ".html", ".sdf")) else as_is


def json_lines(text):
    return [json.loads(line) for line in text.splitlines()]


def as_hash(data):
    return f"{len(data)} bytes, SHA-256 {hashlib.sha256(data).hexdigest()[:16]}"


def read_any(name, data):
    """A file inside another, such as an attachment of a recording."""
    if not is_text(data):
        return as_hash(data)
    text = masked(data.decode("utf-8", "replace"))
    return read_text_of(name, text)(text)


def read_png(data):
    """Size and pixels, regardless of compression."""
    at, packed, tree = 8, b"", {}
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        content = data[at + 8:at + 8 + length]
        if kind == b"IDAT":
            packed += content
        else:
            tree[kind.decode("latin-1")] = content.hex()
        at += 12 + length
    return {**tree, "pixels": as_hash(zlib.decompress(packed))}


def read_pdf(data):
    """All text of the file with decompressed streams; lengths and offsets depend on it and are not compared."""
    parts = re.split(rb"stream\r?\n(.*?)\r?\nendstream", data, flags=re.S)
    for place in range(1, len(parts), 2):
        try:
            parts[place] = zlib.decompress(parts[place])
        except zlib.error:
            pass
    text = b"\n".join(parts).decode("latin-1")
    text = re.sub(r"(?m)^\d{10} \d{5} [nf] ?$|/Length \d+|startxref\s+\d+", "", text)
    return masked(text)


def read_sqlite(data):
    with tempfile.NamedTemporaryFile(suffix=".db3") as file:
        file.write(data)
        file.flush()
        database = sqlite3.connect(f"file:{file.name}?mode=ro&immutable=1", uri=True)
        names = [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type='table' ORDER BY name")]
        tree = {name: [[as_hash(value) if isinstance(value, bytes) else value for value in row]
                       for row in database.execute(f'SELECT * FROM "{name}"')] for name in names}
        database.close()
    return tree


def read_mcap(data):
    """Channels, messages by topic (decoded if they differ), metadata and attachments; chunks and indexes depend on them."""
    schemas, topics = {}, {}
    tree = {"header": "", "channels": {}, "messages": collections.defaultdict(list), "metadata": {}, "attachments": {}}
    for kind, content in records(data, 8):
        if kind == 0x01:
            profile, at = sized(content, 0)
            tree["header"] = f"{profile.decode()} {sized(content, at)[0].decode()}"
        elif kind == 0x03:
            name, at = sized(content, 2)
            encoding, at = sized(content, at)
            schemas[content[:2]] = (name.decode(), sized(content, at)[0].decode())
            tree["channels"][f"type {name.decode()}"] = schemas[content[:2]][1]
        elif kind == 0x04:
            topic, at = sized(content, 4)
            topics[content[:2]] = (topic.decode(), schemas.get(content[2:4], ("", "")))
            tree["channels"][topic.decode()] = topics[content[:2]][1][0] + " " + sized(content, at)[0].decode()
        elif kind == 0x05:
            topic, schema = topics[content[:2]]
            tree["messages"][topic].append(Packed(content[6:], functools.partial(read_message, schema)))
        elif kind == 0x0C:
            name, at = sized(content, 0)
            values, pairs, at = sized(content, at)[0], {}, 0
            while at < len(values):
                key, at = sized(values, at)
                value, at = sized(values, at)
                pairs[key.decode()] = value.decode()
            tree["metadata"][name.decode()] = pairs
        elif kind == 0x09:
            name, at = sized(content, 16)
            _, at = sized(content, at)
            length, = struct.unpack_from("<Q", content, at)
            tree["attachments"][name.decode()] = Packed(content[at + 8:at + 8 + length], functools.partial(read_any, name.decode()))
    return {**tree, "messages": dict(tree["messages"])}


def sized(data, at):
    """Length-prefixed bytes, and the start of the next field."""
    length, = struct.unpack_from("<I", data, at)
    return data[at + 4:at + 4 + length], at + 4 + length


def records(data, at):
    """(opcode, content) of an MCAP file, also of those inside chunks."""
    while at + 9 <= len(data):
        kind, length = struct.unpack_from("<BQ", data, at)
        content = data[at + 9:at + 9 + length]
        at += 9 + length
        if kind == 0x06:
            yield from records(unpacked(content), 0)
        elif kind == 0x02:
            return
        else:
            yield kind, content


def unpacked(chunk):
    size, = struct.unpack_from("<Q", chunk, 16)
    compression, at = sized(chunk, 28)
    packed = chunk[at + 8:]
    if not compression:
        return packed
    if compression != b"zstd":
        raise ValueError(f"chunks packed with {compression.decode()} are not read")
    library = ctypes.CDLL("libzstd.so.1")
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    out = ctypes.create_string_buffer(size)
    if library.ZSTD_decompress(out, size, packed, len(packed)) != size:
        raise ValueError("a chunk does not unpack")
    return out.raw


PLAIN = {"bool": "?", "byte": "B", "char": "B", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I", "int32": "i", "uint64": "Q",
         "int64": "q", "float32": "f", "float64": "d"}
FIELD = re.compile(r"^\s*([\w/]+)(?:<=\d+)?(\[(?:<=)?(\d*)\])?\s+(\w+)\s*(?!=)(?:\s[^=].*|\s*)$")


@functools.lru_cache(maxsize=64)
def definitions(name, text):
    """{type: [(type, array, size, name)]} of a ros2msg schema; types are named by their last word."""
    found = {"Time": [("int32", "", "", "sec"), ("uint32", "", "", "nanosec")], "Duration": [("int32", "", "", "sec"), ("uint32", "", "", "nanosec")]}
    for number, section in enumerate(re.split(r"(?m)^=+\n", text)):
        head, _, rest = section.partition("\n") if number else (f"MSG: {name}", "", section)
        fields = (FIELD.match(line.partition("#")[0]) for line in rest.splitlines())
        found[head.split("/")[-1].strip()] = [(match[1].split("/")[-1], match[2] or "", match[3] or "", match[4]) for match in fields if match]
    return found


def read_message(schema, content):
    """Log and publish time and the fields of a message in plain little-endian CDR; bytes if there is no schema."""
    logged, published = struct.unpack_from("<QQ", content)
    times = {"log_time": logged, "publish_time": published}
    try:
        return {**times, **Cdr(content[20:]).struct(definitions(*schema), schema[0].split("/")[-1])}
    except (KeyError, struct.error):  # a schema that does not describe the message
        return {**times, "data": as_hash(content[16:])}


class Cdr:
    """Reads plain CDR: each number is aligned to its own size."""

    def __init__(self, body):
        self.body, self.at = body, 0

    def numbers(self, code, count):
        size = struct.calcsize(code)
        self.at += -self.at % size if count else 0
        self.at += size * count
        return struct.unpack_from(f"<{count}{code}", self.body, self.at - size * count)

    def struct(self, known, name):
        return {field: self.field(known, kind, array, size) for kind, array, size, field in known[name]}

    def field(self, known, kind, array, size):
        if not array:
            return self.one(known, kind)
        count = int(size) if size and "<=" not in array else self.numbers("I", 1)[0]
        if kind in ("uint8", "byte", "char"):
            self.at += count
            return as_hash(self.body[self.at - count:self.at])
        return list(self.numbers(PLAIN[kind], count)) if kind in PLAIN else [self.one(known, kind) for _ in range(count)]

    def one(self, known, kind):
        if kind in PLAIN:
            return self.numbers(PLAIN[kind], 1)[0]
        if kind != "string":
            return self.struct(known, kind)
        length = self.numbers("I", 1)[0]
        self.at += length
        return self.body[self.at - length:self.at].rstrip(b"\0").decode("utf-8", "replace")


BINARY = {".mcap": read_mcap, ".png": read_png, ".pdf": read_pdf, ".db3": read_sqlite}
