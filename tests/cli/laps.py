"""A recorded lap for tests of several verbs, and the keys of their summaries."""
import pathlib
import shutil
import sys

from harness import PROGRAM, InFolder

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import made as support  # noqa: E402

MAP_KEYS = {"method", "tags", "frames", "tag_rmse_m", "tag_max_m", "tag_orientation_rmse_deg", "trajectory_rmse_m", "wall_s",
            "peak_rss_mib", "warnings"}
REPLAY_KEYS = {"laps_completed", "cross_track_rmse_m", "cross_track_p95_m", "cross_track_max_m", "heading_rmse_deg",
               "min_clearance_m", "two_tags_fraction", "stops", "wall_s"}


LAP, OTHER_LAP, MAP, DEMO = support.LAP, support.OTHER_LAP, support.MAP, support.DEMO
LAP_OF_SQUARE, MAP_OF_SQUARE = support.LAP_OF_SQUARE, support.MAP_OF_SQUARE


def made(*verbs):
    """A read-only folder in which these command lines of the tested program were run."""
    return support.made(PROGRAM, *verbs)


def put(folder, *verbs):
    """Copies the files that these command lines write into a folder."""
    shutil.copytree(made(*verbs), folder, dirs_exist_ok=True)


class WithLap(InFolder):
    MADE = LAP

    def setUp(self):
        super().setUp()
        put(self.folder, *self.MADE)

    def edit(self, path, old, new):
        text = (self.folder / path).read_text()
        self.assertIn(old, text)
        (self.folder / path).write_text(text.replace(old, new, 1))


class WithMap(WithLap):
    MADE = MAP
