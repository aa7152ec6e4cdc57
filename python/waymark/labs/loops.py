"""Experiments for labs 8, 9 and 10 with the functions written in them: two localisations of a lap, two filters in many runs, a
drive along a line."""
import numpy as np

from .. import geometry


def nearest_tag_errors(mine):
    """Lab 8: position errors [m] along the lap, using the nearest tag and odometry."""
    fixed = then = now = None
    errors = []
    for kind, value in mine.events:
        if kind == "odometry":
            now = value
        elif kind == "tags" and now is not None and (best := mine.nearest(value)) is not None:
            at, jump = mine.fix(*best), 0
            if fixed is not None:
                expected = mine.carried(fixed, then, now)
                jump = np.hypot(at.x - expected.x, at.y - expected.y)
            if mine.accepted(np.linalg.norm(best[1].translation), jump):
                fixed, then = at, now
        elif kind == "truth" and fixed is not None:
            at = mine.carried(fixed, then, now)
            errors.append(np.hypot(at.x - value.x, at.y - value.y))
    return np.array(errors)


def filter_errors(mine):
    """Lab 8: position errors [m] along the lap, using a Kalman filter with the notebook's update."""
    x = P = last = None
    errors = []
    for kind, value in mine.events:
        if kind == "odometry":
            if x is not None:
                step = last.inverse() @ value
                ahead = moved(x, [step.x, step.y, step.yaw])
                F = np.eye(3)
                F[:2, 2] = [x[1] - ahead[1], ahead[0] - x[0]]
                x, P = ahead, F @ P @ F.T + 1e-4 * np.hypot(step.x, step.y) * np.eye(3) + 1e-9 * np.eye(3)
            last = value
        elif kind == "tags" and last is not None:
            for name, cam_T_tag in value:
                at, away = mine.fix(name, cam_T_tag), np.linalg.norm(cam_T_tag.translation)
                z, R = np.array([at.x, at.y, at.yaw]), 0.02**2 * away**4 * np.eye(3)
                x, P = (z, R) if x is None else mine.update(x, P, z, R)
        elif kind == "truth" and x is not None:
            errors.append(np.hypot(x[0] - value.x, x[1] - value.y))
    return np.array(errors)


def moved(state, u):
    """The state (x, y, heading) after a step (forward, left, turned)."""
    c, s = np.cos(state[2]), np.sin(state[2])
    return np.asarray(state) + [c * u[0] - s * u[1], s * u[0] + c * u[1], u[2]]


def seen(state, m):
    """A landmark (2,) of the map in the frame of a robot (x, y, heading)."""
    c, s = np.cos(state[2]), np.sin(state[2])
    return np.array([[c, s], [-s, c]]) @ (m - state[:2])


def run_filters(mine, sights, runs=60):
    """Lab 9: fractions of runs within their 95 % regions, after 5 m and this many landmark observations, for the EKF and for the
    right-invariant filter."""
    random = np.random.default_rng([9, sights])
    results = [_run_filters(mine, sights, random) for _ in range(runs)]
    return [mine.share_below(*(np.array(part) for part in zip(*(result[which] for result in results))), 7.815) for which in (0, 1)]


def _run_filters(mine, sights, random):
    start = np.diag([0.1, 0.1, np.radians(mine.start_deg)]) ** 2
    true = np.array([0.0, 0.0, 0.5])
    # Both start with the same estimate and covariance: at p = 0 the two errors are equal to first order.
    estimate = geometry.SE2.exp(random.multivariate_normal(np.zeros(3), start)) @ geometry.SE2(*true)
    plain, P = np.array([estimate.x, estimate.y, estimate.yaw]), start.copy()
    group, S = plain.copy(), start.copy()
    N = mine.sigma_m**2 * np.eye(2)
    for k in range(20 + sights):
        u = np.array([0.25, 0.0, 0.02])
        true = moved(moved(true, u), random.multivariate_normal(np.zeros(3), mine.Q))
        F, G = mine.step_jacobian(plain[2], u), np.eye(3)
        plain, group = moved(plain, u), moved(group, u)
        G[:2, :2] = geometry.SE2(*plain).matrix()[:2, :2]
        P = F @ P @ F.T + G @ mine.Q @ G.T
        A = mine.adjoint(group)
        S = S + A @ mine.Q @ A.T
        if k < 20:
            continue
        m = mine.landmarks[k % len(mine.landmarks)]
        y = seen(true, m) + random.normal(scale=mine.sigma_m, size=2)
        H = mine.seen_jacobian(plain, m)
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + N)
        plain, P = plain + K @ (y - seen(plain, m)), (np.eye(3) - K @ H) @ P
        H = mine.invariant_jacobian(m)
        K = S @ H.T @ np.linalg.inv(H @ S @ H.T + N)
        better = geometry.SE2.exp(-K @ (geometry.SE2(*group) @ y - m)) @ geometry.SE2(*group)
        group, S = np.array([better.x, better.y, better.yaw]), (np.eye(3) - K @ H) @ S
    error = plain - true
    error[2] = np.remainder(error[2] + np.pi, 2 * np.pi) - np.pi
    return (error, P), ((geometry.SE2(*group) @ geometry.SE2(*true).inverse()).log(), S)


def drive_line(mine, aware, ahead_m=None):
    """Lab 10: distances from the line [m] and positions of a robot with a delay that makes only half the commanded turns.
    aware: whether the driver compensates both. ahead_m: a look-ahead distance other than the notebook's."""
    ahead_m = mine.LOOK_AHEAD_M if ahead_m is None else ahead_m
    pose, way, off = geometry.SE2(0, 0.1, 0.7), [], []
    waiting = [(0.0, 0.0)] * round(mine.DELAY_S / mine.PERIOD_S)
    for _ in range(700):
        at = mine.acts_at(pose, [(v, mine.TURN_GAIN * w) for v, w in waiting], mine.PERIOD_S) if aware else pose
        arc = mine.curvature(at.x, at.y, at.yaw, mine.goal(mine.line, at.x, at.y, ahead_m))
        waiting.append(mine.command(0.4, arc, mine.TURN_GAIN if aware else 1.0, 2.0))
        v, w = waiting.pop(0)
        pose = pose @ geometry.SE2.exp([v * mine.PERIOD_S, 0, mine.TURN_GAIN * w * mine.PERIOD_S])
        way.append((pose.x, pose.y))
        off.append(np.hypot(*(mine.line - way[-1]).T).min())
        if np.hypot(*(mine.line[-1] - way[-1])) < 0.1:
            break
    return np.array(off), way
