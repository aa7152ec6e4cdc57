"""How good an estimate is, against the truth that only the simulator knows."""

import math

POSITION_M = 0.25  # an estimate is near enough within this …
HEADING_DEG = 10.0  # … and this


def _rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan


class Score:
    """Collects what a solution shows. The points are the share of pictures, in per cent, after which an estimate was shown within 0.25 m
    and 10 degrees of the truth."""

    def __init__(self):
        self.pictures = 0
        self.images_shown = 0
        self.not_finite = 0  # estimates with NaN or infinity: as if they were not shown
        self.position_m, self.heading_deg = [], []
        self.driven_m = 0.0
        self._truth = None
        self._newest = None
        self._good = 0
        self.trace = []  # (s, (x, y, yaw) estimated, (x, y, yaw) true)

    def picture(self, now_s, truth):
        self._close()
        self.pictures += 1
        if self._truth is not None:
            self.driven_m += math.dist(truth[:2], self._truth[:2])
        self._truth = truth

    def estimate(self, now_s, pose, truth):
        if not all(map(math.isfinite, pose)):
            self.not_finite += 1
            return
        position = math.dist(pose[:2], truth[:2])
        turn = math.degrees(abs(math.remainder(pose[2] - truth[2], 2 * math.pi)))
        self._newest = (position, turn)
        self.trace.append((now_s, pose, truth))

    def show_image(self, image):
        self.images_shown += 1

    def _close(self):
        """The last estimate shown after a picture counts, once."""
        if self._newest is None:
            return
        position, turn = self._newest
        self._newest = None
        self.position_m.append(position)
        self.heading_deg.append(turn)
        self._good += position <= POSITION_M and turn <= HEADING_DEG

    def result(self, pictures_left=0):
        """A dictionary of numbers; NaN where nothing was shown. Pictures of the time that is left count as without an estimate."""
        self._close()
        errors = sorted(self.position_m)
        return {
            "points": round(100 * self._good / max(self.pictures + pictures_left, 1), 1),
            "pictures": self.pictures,
            "estimates": len(errors),
            "estimates_not_finite": self.not_finite,
            "position_rmse_m": round(_rms(errors), 4),
            "position_p95_m": round(errors[min(len(errors) - 1, int(0.95 * len(errors)))], 4) if errors else math.nan,
            "heading_rmse_deg": round(_rms(self.heading_deg), 3),
            "driven_m": round(self.driven_m, 2),
        }
