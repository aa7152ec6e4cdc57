import numpy as np


def delay(command, response, most):
    n = len(command)
    return int(np.argmax([np.corrcoef(command[: n - k], response[k:])[0, 1] for k in range(most + 1)]))


def gain_and_bias(command, response, delayed):
    moved = command[: len(command) - delayed]
    A = np.column_stack([moved, np.ones(len(moved))])
    gain, bias = np.linalg.lstsq(A, response[delayed:], rcond=None)[0]
    return gain, bias


def autocorrelation(residuals, lags):
    r = residuals - residuals.mean()
    return np.array([np.mean(r[:-k] * r[k:]) for k in range(1, lags + 1)]) / r.var()


def apart(a, b):
    x = np.concatenate([a, b])
    below = [np.searchsorted(np.sort(s), x, "right") / len(s) for s in (a, b)]
    return np.abs(below[0] - below[1]).max()


def differ(a, b):
    return apart(a, b) > 1.358 * np.sqrt((len(a) + len(b)) / (len(a) * len(b)))


WRONG = {
    "command moved instead": ("np.corrcoef(command[: n - k], response[k:])", "np.corrcoef(command[k:], response[: n - k])", "samples is too short: does the correlation subtract the"),
    "means left in": ("np.corrcoef(command[: n - k], response[k:])[0, 1]", "command[: n - k] @ response[k:]", "samples is too short: does the correlation subtract the"),
    "beyond the most": ("range(most + 1)", "range(4 * most)", "only delays up to `most` are allowed"),
    "the least correlation": ("int(np.argmax", "int(np.argmin", "samples is too long: does the correlation subtract the"),
    "delay forgotten": ("np.linalg.lstsq(A, response[delayed:], rcond=None)", "np.linalg.lstsq(A, response[: len(moved)], rcond=None)", "gain and bias wrong for a response"),
    "bias forgotten": ("np.ones(len(moved))", "np.zeros(len(moved))", "gain and bias wrong for a response"),
    "mean left in": ("r = residuals - residuals.mean()", "r = residuals", "for smooth noise about a mean of"),
    "not over the variance": (" / r.var()", "", "for smooth noise about a mean of"),
    "largest lag first": ("range(1, lags + 1)", "range(lags, 0, -1)", "for smooth noise about a mean of"),
    "signed distance": ("np.abs(below[0] - below[1]).max()", "(below[0] - below[1]).max()", "which is too little: it is the largest distance"),
    "mean distance": ("np.abs(below[0] - below[1]).max()", "np.abs(below[0] - below[1]).mean()", "for two samples of the same distribution, which is too"),
    "root forgotten": ("np.sqrt((len(a) + len(b)) / (len(a) * len(b)))", "(len(a) + len(b)) / (len(a) * len(b))", "pairs with the same distribution"),
}
