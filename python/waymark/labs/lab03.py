"""The checks of lab 3, tag families and Hamming distance. Do the lab before reading them."""
from .. import families
from . import whole

FAMILY = "tag16h5"


def codes():
    return [int(code) for code in families.family(FAMILY)["codes"]]


def distance(mine):
    for a, b in ((0, 0), (1, 2), (0xFFFF, 0), (codes()[3], codes()[7])):
        if whole(mine.distance(a, b)) != families.hamming_distance(a, b):
            return f"wrong for {a:016b} and {b:016b}"


def turned(mine):
    for code in codes()[:6]:
        found = whole(mine.turned(code))
        if found == families.turned(FAMILY, code, 1):
            continue
        if found == families.turned(FAMILY, code, -1):
            return "it rotates counter-clockwise"
        return "some bits are in the wrong cells" if bin(found).count("1") == bin(code).count("1") else "bits are missing"


def four_turns(mine):
    code = codes()[5]
    for _ in range(4):
        code = whole(mine.turned(code))
    if code != codes()[5]:
        return "four quarter turns do not return the original code"


def family_distance(mine):
    all_codes = codes()
    if whole(mine.family_distance(all_codes)) != families.minimum_distance(FAMILY):
        return "not the smallest distance of the family: which pairs, and which turns, are not compared?"
    if whole(mine.family_distance([all_codes[0], families.turned(FAMILY, all_codes[0], 1)])) != 0:
        return "wrong for a code together with its own quarter turn: can a reader without a known orientation distinguish them?"
    if whole(mine.family_distance([0xFFFF, all_codes[0]])) != 0:
        return "wrong for a family with a code that equals its own rotation: what is its distance to its own rotations?"


def correctable(mine):
    for d in (1, 2, 3, 5, 9, 10, 11):
        found, right = whole(mine.correctable(d)), sum(wrong < d - wrong for wrong in range(1, d))
        if found > right:
            return f"too many for a distance of {d}: take two such codes and flip bits of one: when is it as near to the other?"
        if found < right:
            return f"too few for a distance of {d}: with one more wrong bit the right code would still be the nearest"


CHECKS = [("Hamming distance", 2, distance), ("quarter turn", 3, turned), ("four quarter turns", 1, four_turns), ("distance of a family", 3, family_distance),
          ("correctable bits", 1, correctable)]
