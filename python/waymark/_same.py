"""Methods shared by the value types in the extension module: repr(), ==, copy and pickle using attribute names, or == using their state."""


def _same(a, b):
    """Whether two attributes are equal; arrays are equal if all elements are."""
    if hasattr(a, "shape"):
        return hasattr(b, "shape") and a.shape == b.shape and bool(((a == b) | ((a != a) & (b != b))).all())
    if isinstance(a, (list, tuple)):
        return type(a) is type(b) and len(a) == len(b) and all(map(_same, a, b))
    return a == b


def rebuild(cls, state):
    """Restores the pickled value."""
    return cls(**state)


def repr_of(self):
    values = ", ".join(f"{name}={getattr(self, name)!r}" for name in self._fields)
    return f"{type(self).__name__}({values})"


def equals(self, other):
    if type(self) is not type(other):
        return NotImplemented
    return all(_same(getattr(self, name), getattr(other, name)) for name in self._fields)


def reduce(self):
    return rebuild, (type(self), {name: getattr(self, name) for name in self._fields})


def reduce_ex(self, protocol):
    return object.__reduce_ex__(self, max(2, protocol))


def equals_by_state(self, other):
    if type(self) is not type(other):
        return NotImplemented
    return _same(self.__getstate__(), other.__getstate__())
