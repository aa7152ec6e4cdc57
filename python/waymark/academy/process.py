"""The process that runs a solution: python3 -m waymark.academy.process. It exits if the solution reads no sensor for too long,
even during a call of C code, in a thread, or if the solution catches every exception."""

import faulthandler
import json
import os
import pathlib
import runpy
import sys
import threading
import traceback

from .journal import INTERRUPTED, Journal
from .robot import TAG_FILE, Finished, Robot
from .stand_ins import installed

AFTER_S = 1.0  # for a solution that continues after its time is over


def _own_traceback(failure, path):
    """Removes the frames before the first line of the solution."""
    begin = failure.__traceback__
    while begin is not None and begin.tb_frame.f_code.co_filename != path:
        begin = begin.tb_next
    return "".join(traceback.format_exception(type(failure), failure, begin or failure.__traceback__))


def _hide_end_of_threads():
    shown = threading.excepthook
    threading.excepthook = lambda raised: None if raised.exc_type is Finished else shown(raised)


def _run(path):
    """Runs the file like `python3 file`, which waits for threads."""
    sys.argv = [path]
    sys.path.insert(0, str(pathlib.Path(path).resolve().parent))
    try:
        runpy.run_path(path, run_name="__main__")
    except SystemExit as left:
        if isinstance(left.code, str):
            print(left.code, file=sys.stderr)
    for thread in threading.enumerate():
        if thread is not threading.main_thread() and not thread.daemon:
            thread.join()


def main(arguments):
    """Runs the task of run_file(), given as JSON, and exits."""
    task = json.loads(arguments[0])
    for fd in (task["journal"], task["stall"]):
        os.set_inheritable(fd, False)
    journal = Journal(task["journal"])

    def passed(finished):
        faulthandler.dump_traceback_later(min(task["stall_s"], AFTER_S) if finished else task["stall_s"], exit=True, file=task["stall"])

    robot = Robot(journal, passed, task["seconds"], task["seed"], task["camera_rate_hz"])
    error = None
    _hide_end_of_threads()
    with installed(robot, TAG_FILE):
        try:
            _run(task["path"])
        except Finished:
            pass
        except KeyboardInterrupt:  # the drive up to this point is scored
            error = INTERRUPTED
        except BaseException as failure:  # any error of a solution is part of its result
            error = _own_traceback(failure, task["path"])
    journal.end(error)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):  # the reader is gone, or the solution closed it
            pass
    os._exit(0)  # even if threads are still running


if __name__ == "__main__":
    main(sys.argv[1:])
