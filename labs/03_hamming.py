# %% [markdown]
# # Lab 3: tag families and Hamming distance under rotation
# A tag is a code of bits in a square. A reader does not know which way up it hangs, and some bits may be read wrong. How many may be wrong before one
# tag passes for another? 40 minutes. Source: Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section 2.3.

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
# The print is turned clockwise by 90 degrees. Which code does a reader see then? Work with cells: the bit in cell (x, y) comes to another cell.
# <details><summary>Hint</summary>Seen by the reader the top left cell comes to the top right. Where does (x, y) go in a square of `width` cells?</details>

# %%
def turned(code):
    """int -> int"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The distance of a family
# The smallest distance between two codes in any of their four relative turns, and between a code and its own turns by 90, 180 and 270 degrees.
#
# **Question:** why do the turns of a code with itself count?

# %%
def family_distance(codes):
    """list of int -> int"""
    raise NotImplementedError

# %% [markdown]
# ## 4. How many bits may be corrected?
# With smallest distance d, how many wrong bits can be put right so that no tag passes for another?

# %%
def correctable(d):
    """int -> int"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(3, globals())
