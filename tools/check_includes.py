#!/usr/bin/python3
"""Finds violations that the linker cannot find: headers of rooms that are not linked, and third-party headers in other rooms.

Reads the table cmake/rooms.txt. Debian installs yaml-cpp, Ceres and others in /usr/include, where any file can include them
without linking; and all rooms share one include root. So every #include under waymark/ is checked against the table.

usage: tools/check_includes.py [ROOT]     prints one line per violation; exit code 1 if there is any
"""
import pathlib
import re
import sys

INCLUDE = re.compile(r'^[ \t]*#\s*include\s*([<"])([^>"]+)[>"]', re.M)
TEST_HEADERS = {"gtest", "gmock", "rapidcheck", "opencv2", "nlohmann", "Eigen", "fmt", "tests"}
# C library headers that are included like standard headers.
TOP_LEVEL_THIRD_PARTY = {"zstd.h": "zstd", "lz4.h": "lz4", "lz4frame.h": "lz4", "libdeflate.h": "libdeflate", "bzlib.h": "bzlib", "sqlite3.h": "sqlite3",
                         "jpeglib.h": "jpeglib", "jerror.h": "jpeglib", "turbojpeg.h": "turbojpeg", "png.h": "png",
                         "cairo.h": "cairo", "cairo-svg.h": "cairo", "cairo-pdf.h": "cairo"}


def read_table(path):
    rooms = {}
    for line in path.read_text().splitlines():
        if line.startswith("#") or "|" not in line:
            continue
        name, uses, headers, sources = (part.split() for part in line.split("|"))
        rooms[name[0]] = {"uses": set(uses), "headers": set(headers), "sources": set(headers) | set(sources)}
    for room in rooms.values():  # rows are ordered: rooms reached by an edge are allowed
        if "*" in room["uses"]:
            room["reach"] = set(rooms)
            continue
        room["reach"] = set(room["uses"])
        for used in room["uses"]:
            room["reach"] |= rooms[used].get("reach", set())
    return rooms


def linked_rooms(cmake_lists):
    """The rooms that a room uses, directly or indirectly."""
    match = re.search(r"waymark_room\(\s*[\w/]+([^)]*)\)", cmake_lists.read_text(), re.S)
    words = match.group(1).split() if match else []
    uses, taking = set(), False
    for word in words:
        if word in ("USES", "PUBLIC", "PRIVATE", "TEST_LIBS"):
            taking = word == "USES"
        elif taking:
            uses.add(word)
    return uses


def closure(room, links):
    seen, todo = set(), {room}
    while todo:
        for used in links.get(todo.pop(), set()):
            if used not in seen:
                seen.add(used)
                todo.add(used)
    return seen


def top_of(header):
    if "/" in header:
        return header.split("/")[0]
    return TOP_LEVEL_THIRD_PARTY.get(header)  # None: the standard library, or the C library


def room_of(path, rooms):
    """The room of a file or header, relative to waymark/: its folder, or the nearest parent that is a room."""
    parts = path.split("/")[:-1]
    while parts and "/".join(parts) not in rooms:
        parts.pop()
    return "/".join(parts)


def check_file(path, room_name, rooms, reach, brought):
    room = rooms[room_name]
    text = path.read_text(errors="replace")
    is_test = path.name.endswith("_test.cpp")
    allowed = set(room["headers"] if path.suffix == ".hpp" else room["sources"]) | brought
    allowed |= TEST_HEADERS if is_test else set()
    for match in INCLUDE.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        header = match.group(2)
        parts = header.split("/")
        if parts[0] == "waymark":
            used = room_of("/".join(parts[1:]), rooms)
            if used != room_name and used not in reach:
                yield f"{path}:{line}: room '{room_name}' includes {header} but does not link '{used}'"
        elif match.group(1) == '"' and parts[0] != "tests":
            yield f'{path}:{line}: write "waymark/{room_name}/…" instead of "{header}"'
        else:
            top = top_of(header)
            if top is not None and top not in allowed and top not in ("sys", "linux", "net", "netinet", "arpa"):
                kind = "headers" if path.suffix == ".hpp" else ".cpp files"
                yield f"{path}:{line}: {kind} of room '{room_name}' may not include <{header}> (cmake/rooms.txt)"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent.parent)
    rooms = read_table(root / "cmake/rooms.txt")
    top = root / "waymark"
    links = {name: linked_rooms(top / name / "CMakeLists.txt") for name in rooms if (top / name / "CMakeLists.txt").exists()}
    app = {name for name in rooms if name.startswith("app/")}
    folders = sorted(str(folder.relative_to(top)) for folder in top.rglob("*") if folder.is_dir())
    problems = [f"{top / name}: room '{name}' is not in cmake/rooms.txt" for name in folders
                if not room_of(name + "/", rooms) and not any(room.startswith(name + "/") for room in rooms)]
    for path in sorted(top.rglob("*.[hc]pp")):
        name = room_of(path.relative_to(top).as_posix(), rooms)
        if not name:
            continue
        if name in app and path.name.endswith("_verb.cpp"):  # verbs may use all rooms of the program
            name = "app/cli"
        reach = rooms[name]["reach"] if name in app else closure(name, links)
        if name in app and path.name.endswith("_test.cpp"):  # one program
            reach = reach | set().union(*(rooms[other]["reach"] for other in app)) | app
        brought = set().union(*(rooms[used]["headers"] for used in reach))  # third-party headers that their headers include
        problems.extend(check_file(path, name, rooms, reach, brought))
    print("\n".join(problems) if problems else f"includes of {len(rooms)} rooms are as cmake/rooms.txt allows")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
