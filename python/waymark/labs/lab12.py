"""The checks of lab 12, simulation against reality. Do the lab before reading them."""
import numpy as np

from . import number, numbers, several, truth, whole


def smooth(random, n):
    return np.convolve(random.normal(size=n + 30), np.ones(30) / 30, "valid")[:n]


def late(command, by, before=0.0):
    return np.concatenate([np.full(by, before), command])[:len(command)]


def delay(mine):
    random = np.random.default_rng(12)
    for k in (0, 3, 11):
        command = smooth(random, 800) + 5
        response = late(command, k, 5.0) * 0.5 - 0.3 + random.normal(scale=0.01, size=800)
        found = whole(mine.delay(command.copy(), response, 20))
        if found != k:
            return f"a delay of {found} samples is too {'long' if found > k else 'short'}: does the correlation subtract the means, and is the response shifted forward?"
    command = smooth(random, 800)
    if whole(mine.delay(command, late(command, 11), 5)) > 5:
        return "only delays up to `most` are allowed"


def gain_and_bias(mine):
    random = np.random.default_rng(13)
    for k, gain, bias in ((0, 0.8, 0.0), (4, 0.5, 0.3), (9, 1.1, -0.2)):
        command = smooth(random, 600)
        found = [number(part) for part in several(mine.gain_and_bias(command.copy(), gain * late(command, k) + bias, k), 2)]
        wrong = [name for name, a, b in zip(("gain", "bias"), found, (gain, bias)) if not np.isclose(a, b, atol=1e-6)]
        if wrong:
            return f"{' and '.join(wrong)} wrong for a response {'without delay' if k == 0 else f'{k} samples late'}: it returns {found[0]:.3f} and {found[1]:.3f}"


def autocorrelation(mine):
    x = smooth(np.random.default_rng(14), 500) + 0.7
    centred = x - x.mean()
    for scale in (1.0, 3.0):
        found = numbers(mine.autocorrelation(scale * x, 20), (20,))
        right = np.array([np.mean(centred[:-k] * centred[k:]) for k in range(1, 21)]) / np.mean(centred**2)
        if np.allclose(found, right, atol=0.02):
            continue
        if np.allclose(found[1:], right[:-1], atol=0.02):
            return "it starts with lag 0"
        if scale > 1:
            return "residuals three times as large must give the same result"
        return f"it returns {found[0]:.2f} at lag 1 for smooth noise about a mean of 0.7: too {'much' if found[0] > right[0] else 'little'}"


def shares_apart(a, b):
    x = np.concatenate([a, b])
    return np.abs((a[:, None] <= x).mean(axis=0) - (b[:, None] <= x).mean(axis=0)).max()


def apart(mine):
    random = np.random.default_rng(15)
    for a, b, what in ((random.normal(size=50), random.normal(size=70), "two samples of the same distribution"),
                       (random.normal(size=40), 1 + random.normal(size=20), "two samples, one of which is shifted"),
                       (np.array([1.0, 2.0]), np.array([5.0, 6.0, 7.0]), "1, 2 and 5, 6, 7"), (np.array([5.0, 6.0]), np.array([1.0, 2.0]), "5, 6 and 1, 2")):
        found, right = number(mine.apart(a.copy(), b.copy())), shares_apart(a, b)
        if not np.isclose(found, right, atol=1e-9):
            return f"it returns {found:.3f} for {what}, which is too {'much' if found > right else 'little'}: it is the largest distance between the two distributions, in either direction"


def differ(mine):
    random, wrong = np.random.default_rng(16), [0, 0]
    for _ in range(100):
        for which, shift in enumerate((0, 0.45)):
            a, b = random.normal(size=60), random.normal(size=90) + shift
            wrong[which] += truth(mine.differ(a, b)) is not bool(shares_apart(a, b) > 1.358 * np.sqrt(150 / 5400))
    if any(wrong):
        return f"it is wrong for {wrong[0]} of 100 pairs with the same distribution, and for {wrong[1]} of 100 other pairs"


def robots(mine):
    found = {}
    for name, (command, gyro, measured, true) in mine.laps.items():
        delayed = mine.delay(command, gyro, 40)
        found[name] = gain, bias = mine.gain_and_bias(command, gyro, delayed)
        residuals = gyro[delayed:] - gain * command[:len(command) - delayed] - bias
        print(f"      {name}: {1e3 * delayed * mine.PERIOD_S:.0f} ms late (delay and lag), turns {gain:.2f} of the commanded rate, "
              f"autocorrelation at lag 1 {mine.autocorrelation(residuals, 5)[0]:.2f}, distances {100 * mine.errors(measured, true).mean():+.1f} %")
    lap, plant = mine.errors(*mine.laps["lap"][2:]), mine.errors(*mine.plant)
    print(f"      plant: distances {100 * plant.mean():+.1f} %, distance from lap {mine.apart(lap, plant):.2f}")
    if not (abs(found["lap"][0] - 0.85) < 0.08 and abs(found["other"][0] - 0.6) < 0.08 and mine.differ(lap, plant)):
        return "the robots are not distinguished: ask your teacher"


CHECKS = [("delay", 2, delay), ("gain and bias", 2, gain_and_bias), ("autocorrelation", 2, autocorrelation), ("distance of two samples", 2, apart), ("the test", 1, differ)]
WHOLE = ("three robots", 1, robots)
