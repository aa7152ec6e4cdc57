"""Code shared by the labs: data, figures, and checks that award points and describe errors without giving away the answer.

A lab is a file labs/NN_name.py of cells (`# %%` begins code, `# %% [markdown]` text), which tools/make_notebooks.py converts to a
notebook. The student writes its functions, and `lab = labs.check(NN, globals())` in its last cell but one awards the points.

The checks of a lab are in the module labNN of this package, so the notebook does not show them. Experiments with the students' functions are in `loops`.
"""

import functools
import importlib
import importlib.util
import math
import operator
import os
import pathlib
import sys

MAKE = {
    "samples": "Create it next to the notebook: waymark samples samples",
    "plant": "tools/make_notebooks.py FOLDER writes it next to the notebooks.",
}


LABS = 12


class Wrong(Exception):
    """An error in an answer, as a message for the student."""


def numbers(answer, shape=None):
    """The answer as an array of finite numbers, with the given shape if any (None in it means any length); otherwise raises Wrong."""
    import numpy as np

    if answer is None:
        raise Wrong("it returns nothing: is there a `return`?")
    try:
        array = np.asarray(answer, float)
    except (TypeError, ValueError):
        raise Wrong(f"it returns {_a(answer)} instead of an array of numbers") from None
    if shape is not None and (array.ndim != len(shape) or any(s not in (None, n) for s, n in zip(shape, array.shape))):
        asked = "a single number" if shape == () else f"the shape {tuple('n' if s is None else s for s in shape)}"
        raise Wrong(f"its shape is {array.shape}, expected {asked}".replace("'", ""))
    if not np.isfinite(array).all():
        raise Wrong("the result contains NaN or infinity: a division by zero, or a root of a negative number?")
    return array


def number(answer):
    """The answer as a finite float; otherwise raises Wrong."""
    return float(numbers(answer, ()))


def whole(answer):
    """The answer as an int; otherwise raises Wrong."""
    if answer is None:
        raise Wrong("it returns nothing: is there a `return`?")
    try:
        return operator.index(answer)
    except TypeError:
        raise Wrong(f"it returns {_a(answer)}, expected a whole number") from None


def instance(answer, kind):
    """The answer if it is an instance of the class; otherwise raises Wrong."""
    if answer is None:
        raise Wrong("it returns nothing: is there a `return`?")
    if not isinstance(answer, kind):
        raise Wrong(f"it returns {_a(answer)}, expected {kind.__name__}")
    return answer


def several(answer, count):
    """The parts of an answer that is a tuple or a list of `count` values; otherwise raises Wrong."""
    if answer is None:
        raise Wrong("it returns nothing: is there a `return`?")
    if not isinstance(answer, (tuple, list)) and not getattr(answer, "shape", ()):  # also NumPy arrays
        raise Wrong(f"it returns {_a(answer)}, expected {count} values: `return a, b`")
    if len(answer) != count:
        raise Wrong(f"it returns {len(answer)} values, expected {count}: `return a, b`")
    return answer


def truth(answer):
    """The answer as True or False; otherwise raises Wrong."""
    if answer is None:
        raise Wrong("it returns nothing: is there a `return`?")
    if str(answer) not in ("True", "False"):  # also NumPy's
        raise Wrong(f"it returns {_a(answer)}, expected True or False")
    return bool(answer)


def _a(answer):
    if isinstance(answer, float) and math.isnan(answer):
        return "NaN"
    return f"a {type(answer).__name__}"


def data(name):
    """The path of a file or folder of the labs' data ("samples/lap.mcap"), next to the notebook, or in the folder given by the environment variable
    WAYMARK_LAB_DATA. Raises FileNotFoundError, with the command that creates it, if it is missing."""
    path = pathlib.Path(os.environ.get("WAYMARK_LAB_DATA", ".")) / name
    if not path.exists():
        raise FileNotFoundError(f"{path} is missing. {MAKE.get(pathlib.Path(name).parts[0], '')}".strip())
    return str(path)


def own_data(name):
    """Like data(), for optional files: None if it is missing."""
    try:
        return data(name)
    except FileNotFoundError:
        return None


def own_seconds(path):
    """Reads a recorded lap from any robot with wheel angles and tags. Returns its robot, and for each second the wheel angles (51, 2) [rad]
    and the motion (geometry.SE2), from the trajectory of the map made from the lap."""
    import tempfile

    import numpy as np

    from .. import config, evaluation, mapping, recording, samples

    ticks = {s.stamp_ns: (s.left_rad, s.right_rad) for s in recording.Recording(path).samples() if isinstance(s, samples.WheelTicks)}
    if not ticks:
        raise ValueError(f"{path} contains no wheel angles: record them (joint_states, or the encoders of a LIMO or MBot)")
    with tempfile.TemporaryDirectory() as folder:
        mapped = mapping.map_recording(path, folder).trajectory
        robot = config.read_robot(str(pathlib.Path(folder) / "robot.yaml"))
    stamps = np.array(sorted(ticks))
    angles = np.array([ticks[t] for t in stamps])
    wheels, motions = [], []
    for begin in range(stamps[0], stamps[-1] - 10**9, 10**9):
        ends = [evaluation.pose_at(mapped, stamp) for stamp in (int(begin), int(begin) + 10**9)]
        if None in ends:
            continue
        times = begin + np.arange(51) * 20_000_000
        wheels.append(np.column_stack([np.interp(times - stamps[0], stamps - stamps[0], side) for side in angles.T]))
        a, b = (pose.project_to_plane() for pose in ends)
        motions.append(a.inverse() @ b)
    return robot, wheels, motions


@functools.cache  # once
def _print_that_matplotlib_is_missing():
    print("No figure: Matplotlib is not installed (Debian: python3-matplotlib).")


def figure(title, x_label, y_label, **curves):
    """Draws curves, each an (n, 2) array by its name, in a notebook; does nothing elsewhere. Prints a message once if Matplotlib is missing."""
    if importlib.util.find_spec("matplotlib") is None:
        _print_that_matplotlib_is_missing()
        return
    if "IPython" not in sys.modules:
        return
    import matplotlib.pyplot as plt

    axes = plt.subplots(figsize=(8, 4.5))[1]
    for name, curve in curves.items():
        axes.plot(*zip(*curve), label=name.replace("_", " "))
    axes.set(title=title, xlabel=x_label, ylabel=y_label)
    axes.legend()
    axes.grid(alpha=0.3)
    plt.show()


class Answers:
    """The names of a notebook as attributes; raises Wrong if a cell has not been run."""

    def __init__(self, names):
        self._names = names

    def __getattr__(self, name):
        if name not in self._names:
            raise Wrong(f"{name} is not defined: run the cells from the top")
        return self._names[name]


class Lab:
    """Collects the points of one lab."""

    def __init__(self, name):
        self.name, self.results, self.answers = name, [], None

    def check(self, what, points, test):
        """Awards `points` if `test()` returns None; otherwise it returns, or raises, the error."""
        try:
            wrong = test()
        except NotImplementedError:
            wrong = "not done yet"
        except Wrong as words:
            wrong = str(words)
        except SystemExit:
            wrong = "it ended the program (sys.exit, exit or quit): `return` the result"
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: B036  reports anything raised by a student's function
            wrong = f"it raised {type(error).__name__}: {error}{_place(error)}"
        self.results.append((what, points, wrong))
        print(f"{'ok   ' if wrong is None else 'WRONG'} {points if wrong is None else 0}/{points}  {what}" + ("" if wrong is None else f": {wrong}"))

    @property
    def points(self):
        """The points so far."""
        return sum(points for _, points, wrong in self.results if wrong is None)

    @property
    def possible(self):
        """The points of all checks so far."""
        return sum(points for _, points, _ in self.results)

    def finish(self):
        """Prints the points."""
        print(f"{self.name}: {self.points} of {self.possible} points")


def check(number, names):
    """Checks the functions of a notebook (`globals()`) against the tasks of a lab, prints the points and errors of each, and returns the Lab.

    Raises ValueError if there is no lab of that number, TypeError if `names` is not a dictionary."""
    if isinstance(number, bool) or number not in range(1, LABS + 1):
        raise ValueError(f"labs.check({number!r}, globals()): the labs are 1 to {LABS}")
    if not isinstance(names, dict):
        raise TypeError(f"labs.check({number}, globals()) requires the names of the notebook: {_a(names)} is not a dictionary")
    module, lab = importlib.import_module(f"{__name__}.lab{number:02}"), Lab(f"Lab {number}")
    lab.answers = mine = Answers(names)
    for what, points, test in module.CHECKS:
        lab.check(what, points, lambda test=test: test(mine))
    if hasattr(module, "WHOLE"):  # the experiment that requires all functions
        what, points, test = module.WHOLE
        ready = lab.points == lab.possible
        lab.check(what, points, lambda: test(mine) if ready else "solve the other tasks first")
    lab.finish()
    return lab


def _place(error):
    """The place in the student's function that raised an exception, outside this package's files."""
    place, trace, here = "", error.__traceback__, os.path.dirname(__file__)
    while trace is not None:
        code = trace.tb_frame.f_code
        if not code.co_filename.startswith(here) and "/lib/python" not in code.co_filename:
            place = f" (line {trace.tb_lineno - code.co_firstlineno + 1} of {code.co_name})"
        trace = trace.tb_next
    return place
