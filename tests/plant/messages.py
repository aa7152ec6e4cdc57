"""One line of the protocol of robot processes, without its stamp."""
import typing


class Line(typing.NamedTuple):
    kind: str
    stamp_s: float
    values: dict[str, object]
