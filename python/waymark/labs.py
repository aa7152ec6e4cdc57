"""What the labs share: checks that give points and say what is wrong without the answer.

A lab is a file labs/NN_name.py of cells (`# %%` begins code, `# %% [markdown]` text), which tools/make_notebooks.py turns into a
notebook. Its functions are filled in by the student, and `check(…)` in the last cell gives the points.
"""


class Lab:
    """Collects the points of one lab."""

    def __init__(self, name):
        self.name, self.results = name, []

    def check(self, what, points, test):
        """Awards `points` where `test()` returns None; else it returns, or raises, what is wrong."""
        try:
            wrong = test()
        except NotImplementedError:
            wrong = "not done yet"
        except Exception as error:  # noqa: BLE001  whatever a student's function raises is told
            wrong = f"it raised {type(error).__name__}: {error}"
        self.results.append((what, points, wrong))
        print(f"{'ok   ' if wrong is None else 'WRONG'} {points if wrong is None else 0}/{points}  {what}" + ("" if wrong is None else f": {wrong}"))

    @property
    def points(self):
        return sum(points for _, points, wrong in self.results if wrong is None)

    @property
    def possible(self):
        return sum(points for _, points, _ in self.results)

    def finish(self):
        """Prints and returns the points."""
        print(f"{self.name}: {self.points} of {self.possible} points")
        return self.points
