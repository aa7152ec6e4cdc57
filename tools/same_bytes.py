#!/usr/bin/python3
"""Compares the outputs and files of two builds of waymark field by field, to check a change that must not alter behaviour.

usage: tools/same_bytes.py reference --program OLD --folder REF
       tools/same_bytes.py compare --program NEW --folder REF [--relative 1e-9] [--only 'map.*,wrong.*']
       tools/same_bytes.py ratios --old OLD --new NEW --folder REF [--repeat 5]

OLD and NEW are built programs (build/release/bin/waymark). `reference` runs the commands of same_bytes_commands.py with the old one, each
twice: fields that differ between the two runs are stored as not reproducible, printed, and not compared. `compare` runs the same commands with the
new one in fresh folders. Inputs of a command are the files kept in REF, so that one difference does not cascade. Text must be equal; numbers must be
equal, or with --relative within that fraction (zeros within a millionth of it). With --relative a number printed with at most six decimals may be
rounded to the neighbouring last digit; these are counted. Wall time and memory are masked. same_bytes_renames.txt lists renames and expected differences.
`ratios` alternately runs twelve commands with both programs and prints the ratios of their lowest processor times.
Real recordings are read from WAYMARK_DATA. Examples, the Python package, labs and type stubs are found in the build and the tree of the program
(--examples, --package, --source). Missing ones are skipped and counted. Exit code 1: an unexpected difference; 2: wrong usage.
"""
import argparse
import atexit
import collections
import concurrent.futures
import contextlib
import dataclasses
import fnmatch
import gzip
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

import same_bytes_commands as table
from same_bytes_fields import Difference, Rules, differences

ROOT = pathlib.Path(__file__).resolve().parent.parent
SECONDS = 300  # after which a command is killed
SHOWN = 4  # differences of a file that are printed; --report writes all
NO_MODULE = b"this installation has no module"
LAB = """import pathlib, sys, waymark
lab, solution = (pathlib.Path(name).read_text() for name in sys.argv[1:])
before, after = lab.split('# %% [markdown]\\n# ## Check\\n')
names = {}
for part in (before, solution.partition('\\nWRONG = ')[0], after):
    exec(compile(part, 'lab', 'exec'), names)
print(names['lab'].points, 'of', names['lab'].possible)
"""


def refuse(words):
    print(words, file=sys.stderr)
    sys.exit(2)


@dataclasses.dataclass
class Command:
    name: str
    line: str
    inputs: list = dataclasses.field(default_factory=list)
    code: object = 0  # expected; None: any but 0


def commands_of_table():
    """The commands of the table, ordered so that inputs are written first."""
    found = []
    for line in filter(None, table.COMMANDS.splitlines()):
        head, words = line.split(" : ", 1)
        name, _, inputs = head.partition(" < ")
        words, _, code = words.partition(" # exit ")
        found.append(Command(name.strip(), words.strip(), inputs.split(), int(code or 0)))
    known = set()
    for command in found:
        if command.name in known or not known.issuperset(command.inputs):
            refuse(f"same_bytes_commands.py: {command.name} is a duplicate, or precedes one of its inputs")
        known.add(command.name)
    lines = list(filter(None, table.WRONG.splitlines()))
    return found + [Command(f"wrong.{number:02}", words, [], None) for number, words in enumerate(lines, 1)]


def help_commands(program):
    """--help and --help-all of every verb that the program lists."""
    verbs, found = [""], []
    for verb in verbs:
        text = subprocess.run([program, *verb.split(), "--help"], capture_output=True, text=True, check=False).stdout
        block = re.search(r"^Verbs:\n((?:  .*\n)+)", text, re.M)
        verbs += [f"{verb} {line.split()[0]}".strip() for line in (block[1].splitlines() if block else []) if not line.startswith("   ")]
        for flag in ("--help", "--help-all"):
            found.append(Command(".".join(["help", *verb.split(), flag[2:]]), f"{verb} {flag}".strip()))
    return found


class Build:
    """A program with its examples, its Python package and its tree."""

    def __init__(self, program, options):
        self.program = pathlib.Path(program).resolve()
        if not os.access(self.program, os.X_OK):
            refuse(f"{program} is not a program")
        folder = next((up for up in self.program.parents if (up / "CMakeCache.txt").exists()), self.program.parent)
        self.examples = pathlib.Path(options.examples or folder / "examples")
        self.package = pathlib.Path(options.package or folder / "python")
        self.source = pathlib.Path(options.source or source_of(folder))
        self.data = os.environ.get("WAYMARK_DATA")

    def missing(self, command):
        """The reason why this command cannot be run, or None."""
        words = shlex.split(command.line)
        files = [word.removeprefix("data/") for word in words if word.startswith("data/")]
        if files and not (self.data and all(pathlib.Path(self.data, name).exists() for name in files)):
            return "WAYMARK_DATA does not hold its input"
        if words[0] == "@lab" and not list(self.package.glob("waymark/_waymark*.so")):
            return "no Python package in the build"
        if words[0] == "@stubs":
            return None if list(self.source.glob("python/waymark/*.pyi")) else "no type stubs in the tree"
        if words[0].startswith("@") and words[0] != "@lab" and not (self.examples / f"waymark_{words[0][1:]}").exists():
            return "the example is not built"
        return None

    def places(self, here):
        """Folders whose names are not compared."""
        return {str(here): "<here>", str(self.program.parent): "<bin>", str(self.source): "<source>"}

    def words(self, line):
        """The command line with the program, the example or the interpreter it starts."""
        words = shlex.split(line)
        if words[0] == "@stubs":
            return ["/bin/sh", "-c", f"cp {shlex.quote(str(self.source))}/python/waymark/*.pyi ."]
        if words[0] == "@lab":
            lab = next((self.source / "labs").glob(f"{words[1]}_*.py"))
            return ["/usr/bin/python3", "-c", LAB, str(lab), str(self.source / "labs/solutions" / lab.name)]
        if words[0].startswith("@"):
            return [str(self.examples / f"waymark_{words[0][1:]}"), *words[1:]]
        return [str(self.program), *words]

    def run(self, line, here, output):
        """Exit code and processor time [s] of a command run in a folder; its streams go to output."""
        home = here.parent / f"{here.name}.home"
        (home / "bin").mkdir(parents=True)
        (home / "bin/waymark").symlink_to(self.program)
        environment = {"HOME": str(home), "LC_ALL": "C.UTF-8", "TZ": "UTC", "PATH": f"{home}/bin:/usr/bin:/bin", "PYTHONPATH": str(self.package),
                       "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "agg", "WAYMARK_LAB_DATA": str(here)}
        with open(output / "stdout", "wb") as out, open(output / "stderr", "wb") as err:
            process = subprocess.Popen(self.words(line), cwd=here, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                       start_new_session=True)
            timer = threading.Timer(SECONDS, os.killpg, (process.pid, signal.SIGKILL))
            timer.start()
            _, status, usage = os.wait4(process.pid, 0)
            timer.cancel()
            with contextlib.suppress(ProcessLookupError):  # processes that the command started and did not end
                os.killpg(process.pid, signal.SIGKILL)
        process.returncode = os.waitstatus_to_exitcode(status)
        shutil.rmtree(home)
        return process.returncode, usage.ru_utime + usage.ru_stime


def source_of(build):
    """The source tree of a build folder."""
    cache = build / "CMakeCache.txt"
    found = re.search(r"^CMAKE_HOME_DIRECTORY:\w+=(.*)$", cache.read_text(), re.M) if cache.exists() else None
    return pathlib.Path(found[1]) if found else ROOT


class Net:
    """A folder with a reference, and commands run beside it."""

    def __init__(self, folder, jobs=2):
        self.folder, self.jobs = pathlib.Path(folder).resolve(), jobs
        self.scratch = pathlib.Path(tempfile.mkdtemp(prefix="same-bytes-"))
        atexit.register(shutil.rmtree, self.scratch, ignore_errors=True)

    def prepare(self, here, inputs, data, rename=lambda text: text):
        """Creates a fresh folder with the inputs of a command; returns its files."""
        shutil.copytree(self.folder / "start", here)
        for name in filter(lambda name: (here / name).exists(), table.START):
            (here / name).write_text(rename((here / name).read_text()))
        for name in inputs:
            shutil.copytree(self.folder / "kept" / name / "files", here, dirs_exist_ok=True)
        if data:
            (here / "data").symlink_to(pathlib.Path(data).resolve())
        return contents(here)

    def outcome(self, build, command, line, label, rename=lambda text: text):
        """Runs a command and returns (its outputs and files, {file: bytes}; its folder; processor time)."""
        here, output = self.scratch / label / "here", self.scratch / label
        output.mkdir()
        before = self.prepare(here, command.inputs, build.data, rename)
        code, used_s = build.run(line, here, output)
        after = contents(here)
        found = {name: data for name, data in after.items() if before.get(name) != data}
        found |= {name: b"removed\n" for name in before if name not in after}
        streams = {name: (output / name).read_bytes() for name in ("stdout", "stderr")}
        shutil.rmtree(output)
        found |= {name: b"not reproducible\n" for name in found if volatile(command.name, f"files/{name}", [])}
        return {"exit": f"{code}\n".encode(), **streams, **{f"files/{name}": data for name, data in found.items()}}, here, used_s

    def each(self, commands, work):
        """Results of work(command, wait) in the order of the commands, some at a time; wait(name) until that command is done."""
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            futures = {}
            for command in commands:
                futures[command.name] = pool.submit(work, command, lambda name: futures[name].result())
            for command in commands:
                yield command, futures[command.name].result()


def contents(here):
    """The files below a folder, without following links."""
    return {str(path.relative_to(here)): path.read_bytes() for path in sorted(here.rglob("*")) if path.is_file() and "data" != path.relative_to(here).parts[0]}


def write_all(folder, outcome):
    (folder / "files").mkdir(parents=True, exist_ok=True)
    for name, data in outcome.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def write_start(folder, program):
    """The initial files of every command: photographs, the text files of the table, a recording and a map by the program."""
    sys.path.insert(0, str(ROOT / "tests/cli"))
    import images
    images.fill(folder)
    for name, text in table.START.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    for words in table.START_COMMANDS:
        subprocess.run([program, *words], cwd=folder, check=True, capture_output=True)


def compared(before, after, rules, places):
    """(stream or file, difference) for each difference of two outcomes."""
    renamed = {rules.rename(name) if name.startswith("files/") else name: name for name in before}
    for name, old in renamed.items():
        if name not in after:
            yield name, Difference("file", f"{len(before[old])} bytes", "not written")
        else:
            yield from ((name, found) for found in differences(name, before[old], after[name], rules, places))
    yield from ((name, Difference("file", "not written", f"{len(after[name])} bytes")) for name in after if name not in renamed)


def reference(options):
    folder = pathlib.Path(options.folder)
    if folder.exists() and any(folder.iterdir()):
        refuse(f"{folder} is not empty: a reference is written into a new folder")
    build, net = Build(options.program, options), Net(folder, options.jobs)
    folder.mkdir(parents=True, exist_ok=True)
    write_start(folder / "start", build.program)
    commands = commands_of_table() + help_commands(build.program)
    skipped = {}

    def work(command, wait):
        lost = next((name for name in command.inputs if wait(name) is None), None)
        why = f"{lost} was skipped" if lost else build.missing(command)
        if why:
            skipped[command.name] = why
            return None
        first, here, used_s = net.outcome(build, command, command.line, command.name)
        if command.code == 0 and NO_MODULE in first["stderr"]:
            skipped[command.name] = "a module of the program is not built"
            return None
        again, there, _ = net.outcome(build, command, command.line, f"{command.name}.again")
        write_all(folder / "kept" / command.name, first)
        places = [f"{name} {found.field}" for name, found in compared(first, again, Rules(), (build.places(here), build.places(there)))]
        return {**dataclasses.asdict(command), "places": build.places(here), "volatile": [place for place in places if not volatile(command.name, place, [])],
                "used_s": used_s, "ended": int(first["exit"])}

    kept, wrong = [], 0
    for command, result in net.each(commands, work):
        if result is None:
            continue
        kept.append(result)
        for place in result["volatile"][:SHOWN]:
            print(f"not reproducible: {command.name} {place}")
        if result["ended"] != command.code if command.code is not None else result["ended"] not in (1, 2):
            wrong += 1
            last = (folder / "kept" / command.name / "stderr").read_text(errors="replace").strip().splitlines()[-1:]
            print(f"unexpected exit code {result['ended']}: {command.name}: {command.line}\n    {''.join(last)}")
    (folder / "reference.json").write_text(json.dumps({"commands": kept, "skipped": skipped}, indent=1))
    print_skipped(skipped)
    print(f"{len(kept)} commands kept in {folder}, {sum(bool(one['volatile']) for one in kept)} of them not reproducible in parts, {wrong} with an unexpected exit code")
    return 1 if wrong else 0


def print_skipped(skipped):
    for why, count in collections.Counter(skipped.values()).items():
        print(f"skipped, {why}: {count} ({', '.join([name for name in skipped if skipped[name] == why])})")


def read_reference(folder):
    path = pathlib.Path(folder) / "reference.json"
    if not path.exists():
        refuse(f"{folder} holds no reference: run tools/same_bytes.py reference first")
    return json.loads(path.read_text())


class Renames:
    """The table of renames (same_bytes_renames.txt describes it)."""

    def __init__(self, text):
        self.changes, self.lines, self.expected, self.shares = [], {}, [], []
        for number, line in enumerate(text.splitlines(), 1):
            line = line.strip()
            if not line or line.startswith("#"):
                continue
            match = re.fullmatch(r"(word|key|flag|line)(?:\[(\S+)\])? (.+?) -> (.*)|command (\S+) -> (.+)|expect (\S+) (\S+) (.+)|relative (\S+) (\d\S*) .+", line)
            if not match:
                refuse(f"same_bytes_renames.txt:{number}: not understood: {line}")
            kind, where, old, new, name, words, *expected, glob, share = match.groups()
            if kind:
                edges = (r"(?<![\w-])", r"(?![\w-])") if kind == "flag" else (r"(?<!\w)" if old[0].isalnum() else "", r"(?!\w)" if old[-1].isalnum() else "")
                self.changes.append((kind, where or "*", re.compile(edges[0] + re.escape(old).replace(r"\ ", r"\s+") + edges[1]), new))
            elif name:
                self.lines[name] = words
            elif glob:
                self.shares.append((glob, float(share)))
            else:
                self.expected.append(expected)

    def of(self, name, kinds=("word", "key", "flag")):
        """The function that renames in a text of this command, and whether it does anything."""
        changes = [(pattern, new) for kind, where, pattern, new in self.changes if kind in kinds and fnmatch.fnmatch(name, where)]

        def rename(text):
            for pattern, new in changes:
                text = pattern.sub(lambda _, new=new: new, text)
            return text
        return rename, bool(changes)

    def line(self, command):
        return self.lines.get(command.name, self.of(command.name, ("key", "flag", "line"))[0](command.line))

    def expects(self, command, place):
        """The reason why this difference is expected, or None."""
        return next((why for name, where, why in self.expected if fnmatch.fnmatch(command, name) and fnmatch.fnmatch(place.replace(" ", "_"), where)), None)


def volatile(command, place, places):
    """Whether this place differed between two runs of the reference, or is listed in the table as not reproducible."""
    return place in places or any(fnmatch.fnmatch(place.replace(" ", "_"), where) for where in table.NOT_REPRODUCIBLE.get(command, []))


class Judge:
    """Prints the differences of each command and counts them."""

    def __init__(self, renames, report):
        self.renames, self.counts, self.largest = renames, collections.Counter(), (0.0, "")
        self.report = open(report, "w", encoding="utf-8") if report else None

    def take(self, kept, found, rules):
        """The differences of one command."""
        self.counts.update(rules.accepted)
        if self.report and rules.rounded:
            print(*(f"{kept['name']}: {place} (rounded)" for place in rules.rounded), sep="\n", file=self.report)
        self.largest = max(self.largest, (rules.largest[0], f"{kept['name']} {rules.largest[1]}"))
        shown = 0
        for name, difference in found:
            place = f"{name} {difference.field}"
            why = "not reproducible" if volatile(kept["name"], place, kept["volatile"]) else self.renames.expects(kept["name"], place)
            self.counts["differences" if not why else "not reproducible" if why == "not reproducible" else "expected differences"] += 1
            line = f"{kept['name']}: {place}: {difference.before!r} -> {difference.after!r}" + (f" (expected: {why})" if why else "")
            if self.report:
                print(line, file=self.report)
            if not why and (shown := shown + 1) <= SHOWN:
                print(line if len(line) < 400 else line[:397] + "...", flush=True)
        self.counts["commands that differ"] += shown > 0
        if shown > SHOWN:
            far = f"; numbers apart by up to {rules.worst[0]:.1e} of themselves, {rules.worst[1]}" if rules.worst[0] else ""
            print(f"{kept['name']}: {shown - SHOWN} more{far}")

    def verdict(self, compared_commands, seconds):
        """Prints the totals and returns the exit code."""
        differ, commands = self.counts.pop("differences", 0), self.counts.pop("commands that differ", 0)
        notes = [f"{what}: {count}" for what, count in sorted(self.counts.items())]
        notes += [f"largest relative difference accepted: {self.largest[0]:.1e} ({self.largest[1]})"] if self.largest[0] else []
        print("; ".join([f"{compared_commands} commands compared in {seconds:.0f} s, {differ} differences in {commands} of them", *notes]))
        return 1 if differ else 0


def compare(options):
    begun = time.monotonic()
    build, net = Build(options.program, options), Net(options.folder, options.jobs)
    kept = read_reference(options.folder)
    renames = Renames(pathlib.Path(options.renames).read_text())
    facts = {one["name"]: one for one in kept["commands"] if any(fnmatch.fnmatch(one["name"], part) for part in options.only.split(","))}
    commands = [Command(one["name"], one["line"], one["inputs"], one["code"]) for one in facts.values()]
    skipped, judge = dict(kept["skipped"]) if options.only == "*" else {}, Judge(renames, options.report)

    def work(command, _):
        line = renames.line(command)
        if why := build.missing(dataclasses.replace(command, line=line)):
            skipped[command.name] = why
            return None
        rules = Rules(max([options.relative, *(share for glob, share in renames.shares if fnmatch.fnmatch(command.name, glob))]), *renames.of(command.name))
        after, here, _ = net.outcome(build, command, line, command.name, renames.of(command.name, ("key",))[0])
        if options.keep:
            write_all(pathlib.Path(options.keep) / command.name, after)
        places = facts[command.name]["places"], build.places(here)
        return list(compared(contents(net.folder / "kept" / command.name), after, rules, places)), rules

    done = 0
    for command, result in net.each(commands, work):
        if result:
            done += 1
            judge.take(facts[command.name], *result)
    print_skipped(skipped)
    if new := {command.name for command in commands_of_table()} - {one["name"] for one in kept["commands"]} - set(kept["skipped"]):
        print(f"not in the reference, as they are newer: {', '.join(sorted(new))}")
    return judge.verdict(done, time.monotonic() - begun)


def ratios(options):
    net, kept = Net(options.folder, 1), {one["name"]: one for one in read_reference(options.folder)["commands"]}
    renames = Renames(pathlib.Path(options.renames).read_text())
    builds = {"old": Build(options.old, options), "new": Build(options.new, options)}
    print(f"least processor time of {options.repeat} runs each, in turn; of short ones five times as many\n| command | old, s | new, s | ratio |\n|---|---|---|---|")
    for name in table.RATIOS:
        why = "not in the reference" if name not in kept else next(filter(None, (build.missing(Command(name, kept[name]["line"])) for build in builds.values())), None)
        if why:
            print(f"| {name} | skipped, {why} | | |")
            continue
        command, least = Command(name, kept[name]["line"], kept[name]["inputs"]), {}
        for turn in range(options.repeat * (5 if kept[name]["used_s"] < 0.1 else 1)):
            for which, build in list(builds.items())[::-1 if turn % 2 else 1]:
                line = command.line if which == "old" else renames.line(command)
                _, _, used_s = net.outcome(build, command, line, f"{which}.{turn}.{name}")
                least[which] = min(used_s, least.get(which, used_s))
        print(f"| {name} | {least['old']:.3f} | {least['new']:.3f} | {least['new'] / max(least['old'], 1e-9):.3f} |", flush=True)
    return 0


def options_of(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, usage=argparse.SUPPRESS)
    tasks = parser.add_subparsers(dest="task", required=True)
    for task, programs in ((reference, ("--program",)), (compare, ("--program",)), (ratios, ("--old", "--new"))):
        one = tasks.add_parser(task.__name__)
        one.set_defaults(run=task)
        for flag in (*programs, "--folder"):
            one.add_argument(flag, required=True)
        for flag in ("--examples", "--package", "--source"):
            one.add_argument(flag, help="folder, unless it is that of the program's build or tree")
        one.add_argument("--jobs", type=int, default=2)
        one.add_argument("--renames", default=ROOT / "tools/same_bytes_renames.txt")
    tasks.choices["compare"].add_argument("--relative", type=float, default=0.0)
    tasks.choices["compare"].add_argument("--only", default="*", help="patterns of names, separated by commas")
    tasks.choices["compare"].add_argument("--report", help="file for all differences")
    tasks.choices["compare"].add_argument("--keep", help="folder for what the new program printed and wrote")
    tasks.choices["ratios"].add_argument("--repeat", type=int, default=5)
    return parser.parse_args(words)


if __name__ == "__main__":
    chosen = options_of(sys.argv[1:])
    sys.exit(chosen.run(chosen))
