# %% [markdown]
# # Lab 3: tag families and Hamming distance under rotation
# A tag is a code of bits in a square. A reader does not know which way up it hangs, and some bits may be read wrong. How many may be wrong before one
# tag passes for another? 40 minutes. Source: Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section 2.3.

# %%
import numpy as np

from waymark import families, labs

lab = labs.Lab("Lab 3")
family = families.family("tag16h5")
codes = [int(code) for code in family["codes"]]
bits = family["bits"]  # cell (x, y) of each bit, most significant first, x right, y down
width = family["width_at_border"]
print(len(codes), "codes of", len(bits), "bits")

# %% [markdown]
# ## 1. Hamming distance
# In how many bits do two codes differ?
# <details><summary>Hint</summary>a ^ b has a one where they differ.</details>

# %%
def distance(a, b):
    raise NotImplementedError

# %% [markdown]
# ## 2. A quarter turn
# The print is turned clockwise by 90 degrees. Which code does a reader see then? Work with cells: the bit in cell (x, y) comes to another cell.
# <details><summary>Hint</summary>Seen by the reader the top left cell comes to the top right. Where does (x, y) go in a square of `width` cells?</details>

# %%
def turned(code):
    raise NotImplementedError

# %% [markdown]
# ## 3. The distance of a family
# The smallest distance between two codes in any of their four relative turns, and between a code and its own turns by 90, 180 and 270 degrees.
#
# **Question:** why do the turns of a code with itself count?

# %%
def family_distance(codes):
    raise NotImplementedError

# %% [markdown]
# ## 4. How many bits may be corrected?
# With smallest distance d, how many wrong bits can be put right so that no tag passes for another?

# %%
def correctable(d):
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
def _distance():
    for a, b in ((0, 0), (1, 2), (0xFFFF, 0), (codes[3], codes[7])):
        if labs.whole(distance(a, b)) != families.hamming_distance(a, b):
            return f"wrong for {a:b} and {b:b}"


def _turned():
    for code in codes[:6]:
        right = families.turned("tag16h5", code, 1)
        found = labs.whole(turned(code))
        if found != right:
            if found == families.turned("tag16h5", code, -1):
                return "it turns counter-clockwise"
            return "some bits come to the wrong cells" if bin(found).count("1") == bin(code).count("1") else "bits got lost"


def _four():
    code = codes[5]
    for _ in range(4):
        code = labs.whole(turned(code))
    if code != codes[5]:
        return "four quarter turns are not the whole turn"


def _family():
    if labs.whole(family_distance(codes)) != families.minimum_distance("tag16h5"):
        return "not the smallest distance of the family"
    quarter = families.turned("tag16h5", codes[0], 1)
    if family_distance([codes[0], quarter]) != 0:
        return "a code and its own quarter turn look the same to a reader who does not know what is up"
    symmetric = 0xFFFF
    if family_distance([symmetric, codes[0]]) != 0:
        return "a code that looks the same after a turn has no orientation: its distance is 0"


def _correctable():
    found = [labs.whole(correctable(d)) for d in (1, 2, 3, 5, 9, 10, 11)]
    if found != [0, 0, 1, 2, 4, 4, 5]:
        return "take two codes at distance d and let bits go wrong: when does one become as near to the other?"


lab.check("Hamming distance", 2, _distance)
lab.check("quarter turn", 3, _turned)
lab.check("four quarter turns", 1, _four)
lab.check("distance of a family", 3, _family)
lab.check("correctable bits", 1, _correctable)
lab.finish()
