"""One line of the protocol of robot processes, before it has its stamp."""
import typing


class Line(typing.NamedTuple):
    kind: str
    stamp_s: float
    values: dict[str, object]
