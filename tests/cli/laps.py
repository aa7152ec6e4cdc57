"""What the tests of several verbs begin with: a recorded lap, and what their summaries hold."""
from harness import InFolder

MAP_KEYS = {"method", "tags", "frames", "tag_rmse_m", "tag_max_m", "tag_orientation_rmse_deg", "trajectory_rmse_m", "wall_s",
            "peak_rss_mib", "warnings"}
REPLAY_KEYS = {"laps_completed", "cross_track_rmse_m", "cross_track_p95_m", "cross_track_max_m", "heading_rmse_deg",
               "min_clearance_m", "two_tags_fraction", "stops", "wall_s"}


class WithLap(InFolder):
    def setUp(self):
        super().setUp()
        self.run_here("teach", "--world", "circuit24", "--seed", 2, "-o", "lap.mcap")

    def edit(self, path, old, new):
        text = (self.folder / path).read_text()
        self.assertIn(old, text)
        (self.folder / path).write_text(text.replace(old, new, 1))
