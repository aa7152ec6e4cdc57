# %% [markdown]
# # Lab 3: tag families and Hamming distance under rotation
# A tag is a code of bits in a square. The orientation of the tag is unknown to the reader, and some bits may be misread. How many may be wrong before one
# tag is mistaken for another? 40 minutes. Source: Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section 2.3.

# %%
import numpy as np

from waymark import families, labs

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
    """two codes (int) -> int"""
    raise NotImplementedError

# %% [markdown]
# ## 2. A quarter turn
# The print is rotated clockwise by 90 degrees. Which code is read then? Work with cells: the bit in cell (x, y) moves to another cell.
# <details><summary>Hint</summary>As seen by the reader, the top left cell moves to the top right. Where does (x, y) move in a square of `width` cells?</details>

# %%
def turned(code):
    """int -> int"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The distance of a family
# The smallest distance between two codes in any of their four relative rotations, and between a code and its own rotations by 90, 180 and 270 degrees.
#
# **Question:** why do the rotations of a code itself count?

# %%
def family_distance(codes):
    """list of int -> int"""
    raise NotImplementedError

# %% [markdown]
# ## 4. How many bits may be corrected?
# With smallest distance d, how many wrong bits can be corrected so that no tag is mistaken for another?

# %%
def correctable(d):
    """int -> int"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(3, globals())
