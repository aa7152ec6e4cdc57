#!/usr/bin/python3
"""Learns the weights of waymark/tags/refinement/kept_corners.cpp from the rows of benchmarks/kept_corner_rows.cpp.

    build/release/benchmarks/kept_corner_rows rows.txt
    tools/learn_kept_corners.py rows.txt

Needs SciPy (python3-scipy). Maximum likelihood for normal errors, with a weak prior. The variances are then
scaled to a mean normalised squared error (NEES/8) of TARGET, because the errors have heavier tails than normal ones."""
import sys

import numpy as np
from scipy.optimize import minimize

CAUSES = ["too small", "low contrast", "poor fit", "moved too far", "bent"]
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


def main():
    rows = np.loadtxt(sys.argv[1])
    print("constexpr std::array<KeptWeights, kKeptCauses> kKeptWeights = {{")
    for number, name in enumerate(CAUSES):
        own = Rows(rows[rows[:, 0] == number][:, 1:])
        x = minimize(own.cost, PRIOR, method="Nelder-Mead").x
        scale = np.mean(own.nees(own.covariance(x))) / TARGET
        factor, floor, shift = np.exp(x[:3]) * scale
        print(f"    {{{factor:.2g}, {np.exp(x[3]):.2g}, {np.sqrt(floor):.2g}, {np.sqrt(shift):.2g}}},  // {name}, {len(own.error)} tags")
    print("}};")


if __name__ == "__main__":
    main()
