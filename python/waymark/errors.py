"""Exceptions of Waymark: what is wrong, where, and how to fix it.

Each has the attributes message, hint, source (file), line (1-based), byte (0-based offset) and key (argument or
configuration value); unknown attributes are None or empty.
"""


class WaymarkError(Exception):
    """Any expected failure."""

    message = ""
    hint = ""
    source = ""
    line = None
    byte = None
    key = ""

    def __reduce__(self):
        return _rebuild, (type(self), self.args, dict(self.__dict__))


class InvalidArgument(WaymarkError, ValueError):
    """A value outside its documented range, or contradictory values."""


class NotFound(WaymarkError, LookupError):
    """A missing file, key, tag or topic."""


class Unreadable(WaymarkError, ValueError):
    """Input that exists but cannot be decoded."""


class Unwritable(WaymarkError, OSError):
    """Output that cannot be created or completed."""


class Unsupported(WaymarkError, NotImplementedError):
    """Valid input that this build does not support."""


class LimitExceeded(WaymarkError, MemoryError):
    """A request that exceeds the allowed memory, time or number of pixels."""


def _rebuild(cls, args, attributes):
    error = cls(*args)
    error.__dict__.update(attributes)
    return error
