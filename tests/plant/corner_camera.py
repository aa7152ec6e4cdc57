"""A camera without images: tag corners with t-distributed noise and persistent errors of each tag."""
import dataclasses
import math

import numpy as np

import body
import course


@dataclasses.dataclass
class CornerOptions:
    sigma_px: float = 0.12  # scale of Student's t
    degrees_of_freedom: float = 3.0  # of Student's t; infinite: Gaussian
    lasting_m: float = 0.0003  # of each printed corner in the plane of its tag, the same in all frames
    printing: int = 0  # which set of printed tags is mounted
    miss: float = 0.02
    max_distance_m: float = 3.5
    stated_sigma_px: float = 0.3


def tag_corners(tag: course.Tag) -> np.ndarray:
    """Top left, top right, bottom right, bottom left, in the world."""
    h = tag.size_m / 2
    corners = np.array([[-h, -h, 0, 1], [h, -h, 0, 1], [h, h, 0, 1], [-h, h, 0, 1]])
    return (corners @ tag.world_T_tag().T)[:, :3]


class CornerCamera:
    def __init__(self, camera: body.Camera, tags: tuple[course.Tag, ...], options: CornerOptions, seed: int):
        self._camera, self._tags, self._options = camera, tags, options
        self._rng = np.random.default_rng([seed, 3])
        # The tags are the same on every run.
        printing = np.random.default_rng([len(tags), 99] + ([options.printing] if options.printing else []))
        self._corners = np.array([tag_corners(tag) + options.lasting_m * printing.standard_normal((4, 2)) @ tag.world_T_tag()[:3, :2].T
                                  for tag in tags])

    def look(self, camera_T_world: np.ndarray, dark: bool = False) -> list[dict[str, object]]:
        """The value of `tags` of a line of detections."""
        seen: list[dict[str, object]] = []
        if dark:
            return seen
        points = self._corners @ camera_T_world[:3, :3].T + camera_T_world[:3, 3]
        for place, tag in enumerate(self._tags):
            p = points[place]
            if p[:, 2].min() < 0.25 or p[:, 2].max() > self._options.max_distance_m:
                continue
            normal = np.cross(p[1] - p[0], p[3] - p[0])  # into the tag
            if np.dot(normal, p.mean(axis=0)) < 0.3 * np.linalg.norm(normal) * np.linalg.norm(p.mean(axis=0)):
                continue
            pixels = self._camera.project(p)
            margin = (pixels[1] - pixels[0])[0] / 8  # the white border must be in the image
            if pixels.min() < margin or (pixels[:, 0].max() > body.WIDTH_PX - margin) or pixels[:, 1].max() > body.HEIGHT_PX - margin:
                continue
            if self._rng.random() < self._options.miss:
                continue
            corners = pixels + self._noise_px() + 0.5  # on the wire, pixel centres are at half pixels
            seen.append({"tag": f"tag36h11:{tag.number}", "corners_px": np.round(corners, 4).tolist(),
                         "corner_sigma_px": self._options.stated_sigma_px, "hamming": 0, "decision_margin": 60.0})
        return seen

    def _noise_px(self) -> np.ndarray:
        degrees = self._options.degrees_of_freedom
        return self._options.sigma_px * (self._rng.standard_normal((4, 2)) if math.isinf(degrees) else self._rng.standard_t(degrees, (4, 2)))
