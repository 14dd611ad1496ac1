"""Faults that can be planted in a module: a sign, an index, a factor or a comparison, one at a time.

Sites are found in the syntax tree and changed in the text, so that no other byte of a file differs. Docstrings,
messages, annotations and code for display only have no sites.
"""

import ast
import bisect
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

KINDS = ("sign", "index", "factor", "comparison")
_SIGNS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+")}
_FACTORS = {ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
_OPPOSITE = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
_BOUNDARY = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
_COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
# Functions that make text for people, by a word of their name.
_DISPLAY = re.compile(
    r"(^|_)(repr|str|format|sentence|said|say|words?|title|label|caption|message|text|told|hint|refus\w*|describe)(_|$)"
)
_RAISING = re.compile(r"(Error|Warning|warn|Refused|getLogger|debug|info)$")
# Folders of swarm/, and for some of them the only modules that hold mathematics or the logic of files.
GROUPS: dict[str, str] = {
    "": r"ball_numbers|history|observables|particles|scene|state",
    "bodies": "",
    "contact": "",
    "events": "",
    "exports": "obj|ply|vtkhdf|xyz",
    "files": "appended|checkpoint|checksums|impact_log|impacts|replaced|storage|stored|superblock|trajectory|writer",
    "grains": "",
    "kernel": "arrays|elementary|fours|gravity|heap|random|vector",
    "lanes": "",
    "methods": "",
    "motion": "",
    "pictures": "series|speeds",
    "placing": "",
    "run": "base|counting|doors|engine|impacts|knows|measures|observed|present|result|sequence|softness"
    "|starting_state|tally|turns",
    "sources": "",
    "surfaces": "",
    "triangles": "cut|parts",
}
MODULES = 20
FAULTS = 5
# A module with fewer sites than this has little to choose from.
_ENOUGH = 12


@dataclass(frozen=True)
class Fault:
    """One change of one file: the bytes from `start` to `end`, `old`, become `new`."""

    file: str
    line: int
    kind: str
    start: int
    end: int
    old: str
    new: str
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} [{self.kind}] {self.before} → {self.after}"

    def planted(self, source: bytes) -> bytes:
        """The file with the fault in it."""
        if source[self.start : self.end].decode() != self.old:
            raise ValueError(f"{self.file}:{self.line} is not the file that the fault was found in")
        return source[: self.start] + self.new.encode() + source[self.end :]


def sites(source: bytes, file: str = "module.py") -> list[Fault]:
    r"""Every fault that can be planted in a module, in the order of its text.

    Examples:
        >>> for fault in sites(b"def f(x, k):\n    return -x[0] * 2.0 if k < 1 else x[k]\n"):
        ...     print(fault)
        module.py:2 [sign] return -x[0] * 2.0 if k < 1 else x[k] → return x[0] * 2.0 if k < 1 else x[k]
        module.py:2 [index] return -x[0] * 2.0 if k < 1 else x[k] → return -x[1] * 2.0 if k < 1 else x[k]
        module.py:2 [factor] return -x[0] * 2.0 if k < 1 else x[k] → return -x[0] * 4.0 if k < 1 else x[k]
        module.py:2 [comparison] return -x[0] * 2.0 if k < 1 else x[k] → return -x[0] * 2.0 if k <= 1 else x[k]
    """
    starts = [0]
    for line in source.split(b"\n"):
        starts.append(starts[-1] + len(line) + 1)
    found = []
    for node in _of_code(ast.parse(source)):
        for kind, (start, end), new in _changes(node, source, starts):
            row = bisect.bisect_right(starts, start) - 1
            first, last = starts[row], starts[row + 1] - 1
            before = source[first:last].decode().strip()
            after = (source[first:start] + new.encode() + source[end:last]).decode().strip()
            old = source[start:end].decode()
            found.append(Fault(file, row + 1, kind, start, end, old, new, before, after))
    return sorted(set(found), key=lambda one: (one.start, one.end, one.kind, one.new))


def chosen(package: Path, seed: int) -> list[Fault]:
    """The faults that a seed chooses: five in each of twenty modules of `package`, at least one of each of its folders.

    They follow from the seed and the text of the package alone.
    """
    draw = random.Random(f"planted faults {seed}")
    possible: dict[str, list[list[Fault]]] = {}
    for group, allowed in GROUPS.items():
        folder = package / group
        paths = sorted(folder.glob("*.py") if not group else folder.rglob("*.py"))
        paths = [path for path in paths if re.fullmatch(allowed or r"(?!__)\w+", path.stem)]
        listed = [sites(path.read_bytes(), path.relative_to(package.parent).as_posix()) for path in paths]
        possible[group] = [one for one in listed if len(one) >= _ENOUGH and len({fault.kind for fault in one}) > 2]
        draw.shuffle(possible[group])
    # One of each folder, then one more of those that have the most modules.
    largest = sorted(possible, key=lambda group: (-len(possible[group]), group))
    order = [*GROUPS, *largest * MODULES]
    taken: list[list[Fault]] = []
    for group in order:
        if possible[group] and len(taken) < MODULES:
            taken.append(possible[group].pop())
    taken.sort(key=lambda module: module[0].file)
    texts = [(package.parent / module[0].file).read_bytes() for module in taken]
    return [fault for module, text in zip(taken, texts, strict=True) for fault in _five(module, text, draw)]


def found_again(source: bytes, file: str, line: int, before: str, after: str) -> Fault | None:
    r"""The fault that makes of one line another, nearest to where that was found; None where that line is gone.

    Examples:
        >>> print(found_again(b"a = 1\n\nb = a + 1\n", "module.py", 1, "b = a + 1", "b = a - 1"))
        module.py:3 [sign] b = a + 1 → b = a - 1
        >>> found_again(b"a = 1\n", "module.py", 1, "b = a + 1", "b = a - 1") is None
        True
    """
    found = [one for one in sites(source, file) if (one.before, one.after) == (before, after)]
    return min(found, key=lambda one: abs(one.line - line), default=None)


def _five(module: list[Fault], source: bytes, draw: random.Random) -> list[Fault]:
    """Faults of a module: of each kind in turn, no two in one line."""
    kinds, five, lines = list(KINDS), [], set()
    draw.shuffle(kinds)
    left = {kind: [one for one in module if one.kind == kind] for kind in kinds}
    while len(five) < FAULTS and any(left.values()):
        for kind in kinds:
            left[kind] = [one for one in left[kind] if one.line not in lines]
            if left[kind] and len(five) < FAULTS:
                one = draw.choice(left[kind])
                left[kind].remove(one)
                if _parses(one.planted(source)):
                    five.append(one)
                    lines.add(one.line)
    return sorted(five, key=lambda one: one.start)


def _parses(source: bytes) -> bool:
    try:
        ast.parse(source)
    except SyntaxError:
        return False
    return True


def _of_code(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a tree that hold what a module computes."""
    if isinstance(node, ast.Raise | ast.JoinedStr | ast.Assert) or _is_display(node):
        return
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _of_code(child)


def _is_display(node: ast.AST) -> bool:
    if isinstance(node, ast.FunctionDef):
        return _DISPLAY.search(node.name.strip("_")) is not None
    if isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        return _RAISING.search(name) is not None
    if isinstance(node, ast.Assign | ast.If):
        # Versions, aliases of types, and imports for the type checker alone.
        text = ast.unparse(node.value if isinstance(node, ast.Assign) else node.test)
        return re.search(r"version|TYPE_CHECKING|Callable\[|tuple\[|dict\[|Literal\[", text, re.IGNORECASE) is not None
    return False


def _is_text(node: ast.AST) -> bool:
    """Whether an operand is text or a sequence, for which + and * are no arithmetic."""
    literal = isinstance(node, ast.Constant) and not isinstance(node.value, int | float)
    return literal or isinstance(node, ast.JoinedStr | ast.List | ast.Tuple | ast.ListComp | ast.Dict)


def _changes(node: ast.AST, source: bytes, starts: list[int]) -> Iterator[tuple[str, tuple[int, int], str]]:
    """Kind, place and new text of each fault at a node."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        start = _span(node, starts)[0]
        yield "sign", (start, start + 1), ""
    elif isinstance(node, ast.BinOp) and not _is_text(node.left) and not _is_text(node.right):
        yield from _of_operation(node, source, starts)
    elif isinstance(node, ast.AugAssign) and not _is_text(node.value):
        for kind, table in (("sign", _SIGNS), ("factor", _FACTORS)):
            if type(node.op) in table:
                old, new = table[type(node.op)]
                yield kind, _operator(node.target, node.value, old, source, starts), new
    elif isinstance(node, ast.Subscript):
        for part in node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]:
            for bound in [part.lower, part.upper] if isinstance(part, ast.Slice) else [part]:
                yield from _of_index(bound, starts)
    elif isinstance(node, ast.Compare):
        yield from _of_comparison(node, source, starts)


def _of_comparison(node: ast.Compare, source: bytes, starts: list[int]) -> Iterator[tuple[str, tuple[int, int], str]]:
    operands = [node.left, *node.comparators]
    for operator, left, right in zip(node.ops, operands, operands[1:], strict=False):
        if type(operator) in _COMPARED:
            old = _COMPARED[type(operator)]
            # Between whole numbers the boundary is a fault; between others it has no measure.
            whole = old in _BOUNDARY and (_is_whole(left) or _is_whole(right))
            yield "comparison", _operator(left, right, old, source, starts), (_BOUNDARY if whole else _OPPOSITE)[old]


def _of_operation(node: ast.BinOp, source: bytes, starts: list[int]) -> Iterator[tuple[str, tuple[int, int], str]]:
    if type(node.op) in _SIGNS:
        old, new = _SIGNS[type(node.op)]
        yield "sign", _operator(node.left, node.right, old, source, starts), new
    if not isinstance(node.op, ast.Mult | ast.Div | ast.Pow):
        return
    constants = [one for one in (node.left, node.right) if _is_number(one)]
    for one in constants:
        value = one.value + 1 if isinstance(node.op, ast.Pow) else 2 * one.value
        yield "factor", _span(one, starts), repr(value)
    if not constants and type(node.op) in _FACTORS:
        old, new = _FACTORS[type(node.op)]
        yield "factor", _operator(node.left, node.right, old, source, starts), new


def _of_index(bound: ast.expr | None, starts: list[int]) -> Iterator[tuple[str, tuple[int, int], str]]:
    """The next entry in place of the first, the one before in place of every other."""
    if isinstance(bound, ast.Constant) and type(bound.value) is int:
        yield "index", _span(bound, starts), str(bound.value - 1 if bound.value else 1)
    elif isinstance(bound, ast.UnaryOp) and isinstance(bound.op, ast.USub) and _is_number(bound.operand):
        yield "index", _span(bound, starts), f"-{bound.operand.value + 1}"


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value != 0


def _is_whole(node: ast.AST) -> bool:
    """Whether an operand is a whole number by its form."""
    if isinstance(node, ast.Constant):
        return type(node.value) is int
    name = node.attr if isinstance(node, ast.Attribute) else ""
    if isinstance(node, ast.Call):
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
    return name in ("len", "size", "count", "sum", "ndim")


def _span(node: ast.expr, starts: list[int]) -> tuple[int, int]:
    """Bytes of a node: the columns of the tree are bytes of UTF-8."""
    assert node.end_lineno is not None
    assert node.end_col_offset is not None
    return starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset


def _operator(left: ast.expr, right: ast.expr, sign: str, source: bytes, starts: list[int]) -> tuple[int, int]:
    """Bytes of an operator between two operands; between them are brackets, spaces and comments besides."""
    first, last = _span(left, starts)[1], _span(right, starts)[0]
    between = re.sub(rb"#[^\n]*", lambda comment: b" " * len(comment[0]), source[first:last])
    start = first + between.index(sign.encode())
    return start, start + len(sign)
