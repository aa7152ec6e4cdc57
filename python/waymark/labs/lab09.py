"""The checks of lab 9, EKF against right-invariant EKF. Do the lab before reading them."""
import numpy as np

from .. import geometry
from . import number, numbers
from .loops import moved, run_filters, seen


def slope(function, at, size):
    """The derivative by finite differences."""
    J = np.zeros((size, 3))
    for k, d in enumerate(1e-6 * np.eye(3)):
        J[:, k] = (function(at + d) - function(at - d)) / 2e-6
    return J


def prediction(mine):
    random = np.random.default_rng(9)
    for _ in range(4):
        state, u = random.normal(size=3), random.normal(size=3)
        found, right = numbers(mine.step_jacobian(state[2], u.copy()), (3, 3)), slope(lambda x: moved(x, u), state, 3)
        if not np.allclose(found, right, atol=1e-6):
            if not np.allclose(found[:, :2], right[:, :2]):
                return "how does the end of the step move if its beginning moves by d?"
            return "the column of the heading is wrong: in which direction does the robot move in the map, and how does the end move if that direction changes slightly?"


def observation(mine):
    random = np.random.default_rng(10)
    for _ in range(4):
        state, m = random.normal(size=3), random.normal(size=2)
        found, right = numbers(mine.seen_jacobian(state.copy(), m.copy()), (2, 3)), slope(lambda x: seen(x, m), state, 2)
        if not np.allclose(found[:, :2], right[:, :2], atol=1e-6):
            return "the position part is wrong: in whose frame are observations, and how does a landmark move in it when the robot approaches?"
        if not np.allclose(found[:, 2], right[:, 2], atol=1e-6):
            return "the heading part has the wrong sign" if np.allclose(found[:, 2], -right[:, 2], atol=1e-6) else "the heading part is wrong"


def invariant(mine):
    for m in mine.landmarks:
        found, right = numbers(mine.invariant_jacobian(m.copy()), (2, 3)), slope(lambda xi: geometry.SE2.exp(xi) @ m, np.zeros(3), 2)
        if not np.allclose(found, right, atol=1e-6):
            return "correct except for the rotation" if np.allclose(found[:, :2], right[:, :2]) else "by how much does a small xi move the landmark?"


def adjoint(mine):
    random = np.random.default_rng(11)
    for _ in range(4):
        state = random.normal(size=3)
        found, right = numbers(mine.adjoint(state.copy()), (3, 3)), geometry.SE2(*state).adjoint()
        if np.allclose(found, right, atol=1e-9):
            continue
        if np.allclose(found[:2, :2], right[:2, :2].T, atol=1e-9):
            return "the rotation is inverted"
        return "correct except for the last column" if np.allclose(found[:, :2], right[:, :2], atol=1e-9) else "Ad w is X w X^-1, as a vector"


def share_below(mine):
    random = np.random.default_rng(12)
    A = random.normal(size=(50, 3, 3))
    covariances, errors = A @ A.transpose(0, 2, 1) + 0.1 * np.eye(3), random.normal(size=(50, 3)) * 2
    nees = np.array([e @ np.linalg.solve(P, e) for e, P in zip(errors, covariances)])
    for limit in (1.0, 7.815, 30.0):
        found = number(mine.share_below(errors.copy(), covariances.copy(), limit))
        if np.isclose(found, (nees < limit).mean(), atol=1e-9):
            continue
        if np.isclose(found, (nees >= limit).mean(), atol=1e-9):
            return "that is the fraction above"
        return f"it returns {found:.2f} for the limit {limit}, so too {'many' if found > (nees < limit).mean() else 'few'} are counted: is each error compared with its own covariance?"


def compare(mine):
    mine.shares = shares = {}
    for sights in (0, 1, 4, 16):
        shares[sights] = run_filters(mine, sights)
        print(f"      after {sights:2d} observations {100 * shares[sights][0]:3.0f} % of the EKF's runs are within their 95 %, {100 * shares[sights][1]:3.0f} % of the invariant filter's")
    if shares[16][1] < 0.85 or any(group < plain + 0.2 for plain, group in shares.values()):
        return "the filters do not differ as they should: ask your teacher"


CHECKS = [("prediction", 2, prediction), ("observation", 2, observation), ("observation on the group", 2, invariant), ("noise on the group", 2, adjoint),
          ("consistency", 1, share_below)]
WHOLE = ("the two filters", 1, compare)
