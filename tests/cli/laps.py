"""What the tests of several verbs begin with: a recorded lap, and what their summaries hold."""
import atexit
import functools
import pathlib
import shutil
import tempfile

from harness import InFolder, waymark

MAP_KEYS = {"method", "tags", "frames", "tag_rmse_m", "tag_max_m", "tag_orientation_rmse_deg", "trajectory_rmse_m", "wall_s",
            "peak_rss_mib", "warnings"}
REPLAY_KEYS = {"laps_completed", "cross_track_rmse_m", "cross_track_p95_m", "cross_track_max_m", "heading_rmse_deg",
               "min_clearance_m", "two_tags_fraction", "stops", "wall_s"}


@functools.cache
def made(*verbs):
    """A folder in which these command lines were run, once for all tests of a file: the same lap has the same bytes (map_test.py)."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-made-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    if len(verbs) > 1:
        shutil.copytree(made(*verbs[:-1]), folder, dirs_exist_ok=True)
    outcome = waymark(*verbs[-1].split(), cwd=folder)
    assert outcome.code == 0, outcome.err
    return folder


class WithLap(InFolder):
    MADE = ("teach --world circuit24 --seed 2 -o lap.mcap",)

    def setUp(self):
        super().setUp()
        shutil.copytree(made(*self.MADE), self.folder, dirs_exist_ok=True)

    def edit(self, path, old, new):
        text = (self.folder / path).read_text()
        self.assertIn(old, text)
        (self.folder / path).write_text(text.replace(old, new, 1))


class WithMap(WithLap):
    MADE = (*WithLap.MADE, "map lap.mcap -o map")
