"""Error messages for arguments of the wrong type, made from the signatures listed by pybind11:
argument, expected type, given value."""
import inspect
import re

_SIMPLE = {"float": "a number", "int": "a whole number", "str": "a string", "bool": "True or False", "bytes": "bytes", "dict": "a dictionary",
           "list": "a list", "tuple": "a tuple", "function": "a function", "Callable": "a function"}
_MANY = {"List": "a list", "Set": "a set", "Dict": "a dictionary", "Tuple": "a tuple", "Iterable": "an iterable"}


def _split(text):
    """Splits at commas outside brackets and quotes."""
    parts, depth, start, quoted = [], 0, 0, False
    for i, letter in enumerate(text):
        quoted ^= letter == "'"
        depth += (letter in "([{<") - (letter in ")]}>" and text[i - 1 : i + 1] != "->")
        if letter == "," and depth == 0 and not quoted:
            parts.append(text[start:i].strip())
            start = i + 1
    return [part for part in [*parts, text[start:].strip()] if part]


def _inside(kind):
    """('List', ['float']) of 'List[float]'; a plain name has no parameters."""
    head, bracket, rest = kind.partition("[")
    return head.rsplit(".", 1)[-1], _split(rest[:-1]) if bracket else []


def _class(kind):
    import waymark

    found = re.fullmatch(r"waymark\.(?:_waymark\.)?(\w+)\.(\w+)", kind)
    return getattr(getattr(waymark, found.group(1), None), found.group(2), None) if found else None


def _needed(kind):
    """Describes a type in plain English."""
    head, parts = _inside(kind)
    if head == "Optional":
        return f"{_needed(parts[0])} or None"
    if head == "Union":
        if any("PathLike" in part for part in parts):
            return "a path"
        return "one of " + ", ".join(_inside(part)[0] for part in parts)
    if parts and head in _MANY:
        return f"{_MANY[head]} of {' and '.join(_needed(part) for part in parts)}" if head != "Dict" else f"a dictionary of {_needed(parts[0])} to {_needed(parts[1])}"
    if head == "PathLike":
        return "a path"
    cls = _class(kind)
    return f"a {cls.__module__}.{cls.__name__}" if cls else _SIMPLE.get(head, kind)


def _fits(value, kind):
    """Whether a value may be of a type; True if this cannot be decided."""
    head, parts = _inside(kind)
    if head == "Optional":
        return value is None or _fits(value, parts[0])
    if head == "Union":
        return any(_fits(value, part) for part in parts)
    if head == "float":
        return hasattr(value, "__float__") or hasattr(value, "__index__")
    if head == "int":
        return hasattr(value, "__index__")
    if head == "bool":
        return isinstance(value, bool) or value is None or type(value).__name__ in ("bool_", "bool")
    if head == "str":
        return isinstance(value, (str, bytes))
    if head == "PathLike":
        return isinstance(value, (str, bytes)) or hasattr(value, "__fspath__")
    if head == "List":
        return hasattr(value, "__len__") and hasattr(value, "__getitem__") and not isinstance(value, (str, bytes, dict)) and all(_fits(v, parts[0]) for v in value)
    if head == "Set":
        return isinstance(value, (set, frozenset)) and all(_fits(v, parts[0]) for v in value)
    if head in ("Dict", "dict"):
        return isinstance(value, dict) and all(_fits(k, parts[0]) and _fits(v, parts[1]) for k, v in value.items() if parts)
    cls = _class(kind)
    return cls is None or isinstance(value, cls)


def _with_article(name):
    return f"{'an' if name[:1] in 'aeiouAEIOU' or name.startswith('nd') else 'a'} {name}"


def _given(value):
    if value is None or isinstance(value, bool):
        return str(value)
    if type(value) in (int, float, str):
        text = repr(value)
        return f"{text if len(text) <= 40 else text[:37] + '...'} ({type(value).__name__})"
    if type(value) in (list, tuple):
        return f"{_with_article(type(value).__name__)} of {len(value)}"
    if isinstance(value, type):
        return f"the class {value.__name__}"
    return _with_article(type(value).__name__)


def _wrong(value, kind):
    """What is wrong with a value; empty if it fits."""
    if _inside(kind)[0] == "int" and hasattr(value, "__index__") and not -(2**63) <= value.__index__() < 2**63:
        return "is too large a whole number"
    return "" if _fits(value, kind) else f"is {_given(value)}: expected {_needed(kind)}"


class _Signature:
    def __init__(self, text):
        self.head = text.partition("(")[0]
        self.parameters, self.any = [], False
        for part in _split(text[text.index("(") + 1 : text.rindex(")")]):
            if part.startswith("*"):
                self.any |= part.startswith("**")
                continue
            name, _, rest = part.partition(": ")
            kind, default, _ = rest.partition(" = ")
            self.parameters.append((name, kind, bool(default)))

    @property
    def keywords_only(self):
        return self.any and not self.parameters

    @property
    def shown(self):
        return ", ".join(name for name, _, _ in self.parameters if name != "self")

    def complaint(self, args, kwargs):
        """(how close the arguments come to this signature, what is wrong with them)"""
        names = [name for name, _, _ in self.parameters]
        if len(args) > len(names) and self.keywords_only:
            return 1, f"takes keyword arguments only: {', '.join(getattr(_class(self.head), '_fields', ()))}"
        if len(args) > len(names):
            return 0, f"takes {len([n for n in names if n != 'self'])} arguments ({self.shown}), but {len(args) - (names[:1] == ['self'])} were given"
        for name in kwargs:
            if name not in names and not self.any:
                return 0, f"has no argument '{name}'. Known: {self.shown or 'none'}"
        values = {**dict(zip(names, args)), **kwargs}
        for name, _, default in self.parameters:
            if name not in values and not default:
                return 1, f"lacks the argument '{name}'. It takes {self.shown}"
        wrong = [(name, words) for name, kind, _ in self.parameters if name in values and (words := _wrong(values[name], kind))]
        if wrong:
            return 2, f"argument '{wrong[0][0]}' {wrong[0][1]}"
        for name, kind, _ in self.parameters:
            if _inside(kind)[0] == "int" and name in values and values[name] < 0:
                return 2, f"argument '{name}' is {values[name]}: expected a whole number of 0 or more"
        return 2, f"the arguments do not match. It takes {', '.join(f'{name}: {_needed(kind)}' for name, kind, _ in self.parameters if name != 'self')}"


def _other_ways(signature):
    """The static factory functions of a class."""
    cls = _class(signature.head)
    ways = sorted(name for name, value in vars(cls).items() if name.startswith("from_") and isinstance(value, staticmethod)) if cls else []
    return f". Other ways: {', '.join(f'{cls.__name__}.{name}()' for name in ways)}" if ways else ""


def words(text, setter, args, kwargs):
    """The message that replaces pybind11's `text`. setter: name of the assigned attribute, empty for a call."""
    signatures = [_Signature(line) for line in re.findall(r"^    \d+\. (.*)$", text.partition("\nInvoked with:")[0], re.M)]
    name = text.partition("(): incompatible")[0]
    if not signatures:
        return text
    if setter:
        return f"{setter} {_wrong(args[1], signatures[0].parameters[1][1]) or 'cannot be ' + _given(args[1])}"
    if "incompatible constructor" in text:
        args, name = args[1:], signatures[0].head.rsplit(".", 1)[-1]
    elif args and signatures[0].parameters[:1] and signatures[0].parameters[0][0] == "self":
        name = f"{_inside(signatures[0].parameters[0][1])[0]}.{name}"
    complaints = [signature.complaint(args, kwargs) for signature in signatures]
    best = max(range(len(complaints)), key=lambda i: complaints[i][0])
    return inspect.cleandoc(f"{name}(): {complaints[best][1]}{_other_ways(signatures[best]) if 'constructor' in text else ''}")
