#!/usr/bin/python3
"""Objects made by Class.__new__(Class), whose __init__() was never called: whatever is done with them raises TypeError, and nothing crashes.

usage: uninitialised_test.py     (PYTHONPATH names the package)
"""
import copy
import inspect
import pickle
import unittest

import waymark
from waymark import config, errors, geometry, recording, samples, simulation

MOST_ARGUMENTS = 8
# Only give the object back.
HARMLESS = {("Writer", "__enter__"), ("Iterator", "__iter__")}
# Of object itself, and what begins a value.
OF_OBJECT = {"__new__", "__init__", "__setstate__", "__getattribute__", "__setattr__", "__delattr__", "__dir__", "__format__", "__hash__", "__sizeof__",
             "__init_subclass__", "__subclasshook__", "__class__", "__reduce_ex__"}


def modules():
    return [module for module in vars(waymark).values()
            if inspect.ismodule(module) and module.__name__.startswith("waymark.") and module.__name__ not in ("waymark._waymark", "waymark.errors")]


def classes():
    base = geometry.SE3.__mro__[-2]  # pybind11's own
    return sorted({value for module in modules() for value in vars(module).values() if isinstance(value, type) and issubclass(value, base)},
                  key=lambda cls: cls.__name__)


def error_of(call, *arguments):
    """The error of a call with incomplete values as text; empty if it raises nothing."""
    try:
        call(*arguments)
    except (TypeError, ValueError, IndexError, KeyError, AttributeError, RuntimeError, errors.WaymarkError) as error:
        return f"{type(error).__name__}: {error}"
    return ""


def attempts(call, first):
    """The errors for this argument among any number of unused arguments before and after it."""
    for count in range(MOST_ARGUMENTS):
        for at in range(count + 1):
            yield error_of(call, *[None] * at, first, *[None] * (count - at))


class Uninitialised(unittest.TestCase):
    def test_all_classes_are_covered(self):
        names = {cls.__name__ for cls in classes()}
        self.assertGreater(len(names), 30)
        for name in ("SE3", "CameraModel", "TagFrame", "Detector", "World", "Recording", "Iterator", "Writer", "Localizer", "Simulator", "ReplayStep"):
            self.assertIn(name, names)

    def test_attributes(self):
        for cls in classes():
            properties = [name for name, value in vars(cls).items() if isinstance(value, property)]
            for name in properties:
                empty = cls.__new__(cls)
                with self.assertRaisesRegex(TypeError, "__init__", msg=f"{cls.__name__}.{name}"):
                    getattr(empty, name)
                if getattr(cls, name).fset is not None:
                    with self.assertRaises(TypeError, msg=f"{cls.__name__}.{name} ="):
                        setattr(empty, name, None)

    def test_methods(self):
        for cls in classes():
            for name in sorted(set(vars(cls)) - OF_OBJECT):
                method = inspect.getattr_static(cls, name)
                if isinstance(method, (property, staticmethod)) or not callable(method) or (cls.__name__, name) in HARMLESS:
                    continue
                words = [error_of(getattr(cls.__new__(cls), name), *[other] * count)
                         for count in range(MOST_ARGUMENTS) for other in (None, cls.__new__(cls))]
                refused = [word for word in words if word.startswith("TypeError") and
                           ("__init__() was not called" in word or "can be neither pickled nor copied" in word)]
                self.assertTrue(refused, f"{cls.__name__}.{name}: {words}")

    def test_python_itself(self):
        for cls in classes():
            empty = cls.__new__(cls)
            for call in (pickle.dumps, copy.copy, copy.deepcopy):
                with self.assertRaises(TypeError, msg=f"{call.__name__} of {cls.__name__}"):
                    call(empty)
            for call in (repr, str, lambda x: x == x, lambda x: x != cls.__new__(cls), hash, list, len, bool, dir):
                error_of(call, empty)
            self.assertIsInstance(empty, cls)

    def test_as_arguments(self):
        """Of all functions, static methods and constructors, at every place."""
        empties = [cls.__new__(cls) for cls in classes()]
        functions = [value for module in modules() for value in vars(module).values() if inspect.isbuiltin(value)]
        functions += [getattr(cls, name) for cls in classes() for name, value in vars(cls).items() if isinstance(value, staticmethod)]
        self.assertGreater(len(functions), 50)
        refused = 0
        for function in functions + classes():
            for empty in empties:
                refused += sum("__init__() was not called" in text for text in attempts(function, empty))
        self.assertGreater(refused, 30)

    def test_within_others(self):
        empty = samples.TagDetection.__new__(samples.TagDetection)
        frame = samples.TagFrame()
        with self.assertRaisesRegex(TypeError, "__init__"):
            frame.detections = [samples.TagDetection(), empty]
        with self.assertRaisesRegex(TypeError, "__init__"):
            samples.Odometry(odom_T_base=geometry.SE2.__new__(geometry.SE2))
        with self.assertRaisesRegex(TypeError, "__init__"):
            samples.TagMap()[3] = samples.MappedTag.__new__(samples.MappedTag)
        with self.assertRaisesRegex(TypeError, "__init__"):
            geometry.SE3() @ geometry.SE3.__new__(geometry.SE3)
        with self.assertRaisesRegex(TypeError, "__init__"):
            simulation.scripted_lap(config.World.__new__(config.World), config.read_robot("limo"))
        with self.assertRaisesRegex(TypeError, "__init__"):
            list(recording.Recording.__new__(recording.Recording))

    def test_derived_classes(self):
        class Late(samples.Odometry):
            def __init__(self):
                self.early = error_of(lambda: self.speed_m_s)
                super().__init__(speed_m_s=2)

        class Never(geometry.SE3):
            def __init__(self):
                pass

        late = Late()
        self.assertIn("__init__", late.early)
        self.assertEqual(late.speed_m_s, 2)
        with self.assertRaisesRegex(TypeError, "__init__"):
            Never()
        with self.assertRaisesRegex(TypeError, "__init__"):
            Never.__new__(Never).log()

    def test_initialised_afterwards(self):
        pose = geometry.SE2.__new__(geometry.SE2)
        self.assertIn("__init__", error_of(pose.log))
        pose.__init__(1, 2, 0.5)
        self.assertEqual((pose.x, pose.y), (1, 2))
        pose.__init__(3, 4, 0.5)
        self.assertEqual(pose.x, 1, "a value is begun once")


if __name__ == "__main__":
    unittest.main()
