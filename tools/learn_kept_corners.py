#!/usr/bin/python3
"""Learns the weights of waymark/tags/refinement/kept_corners.cpp from the rows of tests/kept_corners_test.cpp.

    WAYMARK_KEPT_ROWS=rows.txt build/dev/tests/waymark_tags_tests --gtest_filter='KeptCorners.WriteRows'
    tools/learn_kept_corners.py rows.txt

Maximum likelihood for normal errors (simplex search of Nelder and Mead), with a weak prior. The variances are then
scaled to a mean normalised squared error (NEES/8) of TARGET, because the errors have heavier tails than normal ones."""
import sys

import numpy as np

CAUSES = ["cut by border", "too small", "low contrast", "poor fit", "moved too far", "bent"]
PRIOR = np.array([1.0, -5.0, -4.0, 2.0])  # logarithms: factor, floor squared, shift squared, hidden
TARGET = 0.65


class Rows:
    """Tags of one cause: share, 8 errors of the moved corners, 8 shifts, 64 covariances."""

    def __init__(self, rows):
        self.hidden, self.error = 1 - rows[:, 0], rows[:, 1:9]
        self.shift2 = np.repeat((rows[:, 9:17].reshape(-1, 4, 2) ** 2).sum(2), 2, axis=1)
        self.steps = rows[:, 17:].reshape(-1, 8, 8)

    def covariance(self, x):
        factor = np.exp(x[0] + np.exp(x[3]) * self.hidden)
        return factor[:, None, None] * self.steps + (np.exp(x[1]) + np.exp(x[2]) * self.shift2)[:, :, None] * np.eye(8)

    def nees(self, C):
        return np.sum(self.error * np.linalg.solve(C, self.error[:, :, None])[:, :, 0], axis=1) / 8

    def cost(self, x):
        C = self.covariance(x)
        likelihood = 0.5 * np.mean(np.linalg.slogdet(C)[1] / 8 + self.nees(C))
        return likelihood + (1e-4 + 0.025 / len(C)) * np.sum((x - PRIOR) ** 2)


def lowest(cost, x, rounds=500):
    points = [x] + [x + 0.5 * unit for unit in np.eye(len(x))]
    values = [cost(p) for p in points]
    for _ in range(rounds):
        order = np.argsort(values)
        points, values = [points[i] for i in order], [values[i] for i in order]
        if values[-1] - values[0] < 1e-7:
            break
        middle = np.mean(points[:-1], axis=0)
        for step in (2.0, 1.0, -0.5):
            tried = middle + step * (middle - points[-1])
            value = cost(tried)
            if value < (values[0] if step == 2.0 else values[-2]):
                points[-1], values[-1] = tried, value
                break
        else:
            points = [points[0]] + [points[0] + 0.5 * (p - points[0]) for p in points[1:]]
            values = [values[0]] + [cost(p) for p in points[1:]]
    return points[int(np.argmin(values))]


def main():
    rows = np.loadtxt(sys.argv[1])
    print(f"constexpr std::array<KeptWeights, kKeptCauses> kKeptWeights = {{{{")
    for number, name in enumerate(CAUSES):
        own = Rows(rows[rows[:, 0] == number][:, 1:])
        x = lowest(own.cost, PRIOR)
        scale = np.mean(own.nees(own.covariance(x))) / TARGET
        factor, floor, shift = np.exp(x[:3]) * scale
        print(f"    {{{factor:.2g}, {np.exp(x[3]):.2g}, {np.sqrt(floor):.2g}, {np.sqrt(shift):.2g}}},  // {name}, {len(own.error)} tags")
    print("}};")


if __name__ == "__main__":
    main()
