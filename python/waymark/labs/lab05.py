"""The checks of lab 5, noise and the Cramér-Rao bound. Do the lab before reading them."""
import numpy as np

from .. import geometry, pose, samples
from . import number, numbers


def slope(mine):
    """The derivative (8, 6) of the corners by finite differences."""
    J = np.zeros((8, 6))
    for k, step in enumerate(1e-6 * np.eye(6)):
        ahead, behind = (mine.lens.project(geometry.SE3.exp(s * step) @ mine.cam_corners) for s in (1, -1))
        J[:, k] = ((ahead - behind) / 2e-6).ravel()
    return J


def pixel(mine):
    for p in mine.cam_corners:
        found, right = numbers(mine.pixel_jacobian(p.copy()), (2, 3)), mine.lens.project_jacobian(p)
        if not np.allclose(found, right, atol=1e-9):
            return "the first two columns are correct, but the third is not" if np.allclose(found[:, :2], right[:, :2]) else \
                "compare it with (project(p + d) - project(p)) / d"


def corners(mine):
    found, right = numbers(mine.pose_jacobian(), (8, 6)), slope(mine)
    if not np.allclose(found[:, :3], right[:, :3], atol=1e-3):
        return "the translation part is wrong"
    if not np.allclose(found[:, 3:], right[:, 3:], atol=1e-3):
        return "the rotation has the wrong sign" if np.allclose(found[:, 3:], -right[:, 3:], atol=1e-3) else "the rotation part is wrong"


def bound(mine):
    J = slope(mine)
    found, twice = (numbers(mine.bound(J.copy(), sigma), (6, 6)) for sigma in (mine.sigma_px, 2 * mine.sigma_px))
    if np.trace(twice) <= np.trace(found):
        return "it does not grow with the noise"
    if not np.allclose(twice, 4 * found):
        return "how must a covariance change if each error is twice as large? Yours changes differently"
    if not np.allclose(J.T @ J @ found, mine.sigma_px**2 * np.eye(6), rtol=1e-6, atol=1e-6):
        return "it is not the inverse of the information"


def errors(mine):
    """Errors (400, 6) of poses from corners with noise, their bound, and the normalised errors squared."""
    random, found, clean = np.random.default_rng(5), [], mine.lens.project(mine.cam_corners)
    for _ in range(400):
        seen = samples.TagDetection(tag=0, corners_px=clean + random.normal(scale=mine.sigma_px, size=(4, 2)))
        best = pose.estimate_tag_pose(seen, mine.size_m, mine.lens, corner_sigma_px=mine.sigma_px).best
        found.append((best.cam_T_tag @ mine.cam_T_tag.inverse()).log())
    information = slope(mine).T @ slope(mine) / mine.sigma_px**2
    return np.array(found), np.linalg.inv(information), np.einsum("ni,ij,nj->n", found, information, found)


def mean_nees(mine):
    E, P, nees = errors(mine)
    found = number(mine.mean_nees(E, P))
    if np.isclose(found, nees.mean(), rtol=1e-6):
        return None
    if np.isclose(found, nees.sum(), rtol=1e-6):
        return "that is the sum over all errors"
    if np.isclose(found, nees.mean() / E.shape[1], rtol=1e-6):
        return "that is the mean for one coordinate"
    return f"it returns {found:.3g} for 400 errors that are consistent with their covariance: which value do you expect?"


def share_inside(mine):
    E, P, nees = errors(mine)
    for scale in (1.0, 2.0):
        found = number(mine.share_inside(scale * E, P))
        inside = (scale**2 * nees <= 12.592).mean()
        if np.isclose(found, inside, atol=1e-6):
            continue
        if np.isclose(found, 1 - inside, atol=1e-6):
            return "that is the fraction outside"
        return f"it returns {found:.3f} for 400 errors{' that are twice as large as their covariance predicts' if scale > 1 else ' that are consistent with their covariance'}"


CHECKS = [("derivative of a pixel", 2, pixel), ("derivative of the corners", 3, corners), ("bound", 2, bound), ("mean NEES", 2, mean_nees),
          ("fraction inside", 1, share_inside)]
