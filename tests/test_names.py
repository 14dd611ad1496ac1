"""A word means one thing: what two modules of a package define by one name is one interface."""

import ast
import functools
import re
import tokenize
from collections import Counter, defaultdict
from pathlib import Path

import pytest

import swarm

pytestmark = pytest.mark.quick

ROOT = Path(swarm.__file__).parent
PACKAGES = sorted({path.parent.relative_to(ROOT) for path in ROOT.rglob("*.py")}, key=str)
FILES = [path for name in ("swarm", "tests", "bench", "examples") for path in (ROOT.parent / name).rglob("*.py")]
DEFINITIONS = ast.FunctionDef | ast.ClassDef
NAMES = re.compile(r"(^|_)(who|whom|told|said)(_|$)", re.IGNORECASE)
# What a file with such a name has in its text.
IN_TEXT = re.compile(r"(?<![a-z0-9])(who|whom|told|said)(?![a-z0-9])", re.IGNORECASE)
# Turns of phrase that a reader has to decode: a function returns -1, and particles are no people.
TURNS = re.compile(
    r"\b([Ww]ho|[Ww]hom|[Ww]hoever|[Nn]obody|[Kk]nows? no|of one's own|(is|are) none|ha(s|ve) gone)\b(?![/|])",
)
STRINGS = (tokenize.STRING, getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING))  # the second from Python 3.12 on
# Of what users read, --help among it, and of what explains the code, also "whose" of things.
PLAIN = re.compile(TURNS.pattern + r"|\b[Ww]hose\b")
# Turns of docstrings and comments that leave a reader to find the noun: an amount is named, and so is a thing.
ELLIPSES = re.compile(
    r"\b[Ss]o (many|much|few|often)\b(?! that)|\b[Tt]hat many\b|\bhow many (there|they) are\b|\bone of (which|both)\b"
    r"|\b[Ww]hat (moves|becomes|comes|slides|crosses|flies|stays|turns|rests|hits|touches|remains)\b"
    r"|\b(of|than|less|but) what\b|\bwhat (they|these|those) \w+|\b[Aa]s kernels (take|know) (it|them)\b"
    r"|\bAs of\b|^\"*(The same|Those|That|Of) (of|by|for|as|with|that)\b|\bLet (those|them|it)\b|\basked again\b"
)
PAGES = [
    path
    for pattern in (
        "README.md",
        "bench/*.md",
        "examples/**/*.md",
        "examples/**/*.ipynb",
        "examples/**/*.toml",
        "swarm/**/*.toml",
    )
    for path in ROOT.parent.glob(pattern)
    if ".ipynb_checkpoints" not in path.parts
]


@functools.cache
def parsed(path):
    return ast.parse(path.read_text("utf-8"))


def definitions(package):
    """Name -> (module, arguments of the function, or of the methods of the class) of what modules define for others."""
    found = defaultdict(list)
    for path in sorted((ROOT / package).glob("*.py")):
        for node in parsed(path).body:
            if isinstance(node, DEFINITIONS) and not node.name.startswith("_"):
                found[node.name].append((path.name, arguments(node)))
    return found


def arguments(node):
    if isinstance(node, ast.FunctionDef):
        return tuple(one.arg for one in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs))
    return tuple(sorted(one.name for one in node.body if isinstance(one, ast.FunctionDef)))


@pytest.mark.parametrize("package", PACKAGES, ids=str)
def test_a_name_has_one_meaning_in_a_package(package):
    other = {name: found for name, found in definitions(package).items() if len({what for _, what in found}) > 1}
    assert not other


def test_a_class_name_stands_once():
    """In the whole package, so that a search for it finds the class."""
    found = defaultdict(list)
    for path in sorted(ROOT.rglob("*.py")):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                found[node.name].append(str(path.relative_to(ROOT)))
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def test_a_name_of_a_file_of_tests_stands_once():
    """pytest imports a file of tests by its name alone, for their folders are no packages."""
    found = Counter(path.name for path in (ROOT.parent / "tests").rglob("test_*.py"))
    assert {name: count for name, count in found.items() if count > 1} == {}


def test_a_file_name_stands_at_most_twice():
    """But for those that Python gives."""
    found = Counter(path.name for path in ROOT.rglob("*.py") if not path.name.startswith("__"))
    assert {name: count for name, count in found.items() if count > 2} == {}


def test_texts_are_in_plain_words():
    """Docstrings, comments, messages and captions."""
    found = []
    for path in FILES:
        turns = TURNS if path.is_relative_to(ROOT.parent / "tests") else PLAIN
        if not turns.search(path.read_text("utf-8")):
            continue
        with path.open("rb") as file:
            tokens = list(tokenize.tokenize(file.readline))
        texts = [one for one in tokens if one.type in (tokenize.COMMENT, *STRINGS)]
        found += [f"{path}:{one.start[0]}: {turn[0]}" for one in texts for turn in turns.finditer(one.string)]
    assert found == []


def test_sentences_name_what_they_are_about():
    """Docstrings and comments of the package."""
    found = []
    for path in ROOT.rglob("*.py"):
        with path.open("rb") as file:
            tokens = list(tokenize.tokenize(file.readline))
        texts = [one for one in tokens if one.type == tokenize.COMMENT or one.string.startswith('"""')]
        found += [f"{path}:{one.start[0]}: {turn[0]}" for one in texts for turn in ELLIPSES.finditer(one.string)]
    assert found == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT.parent)))
def test_pages_are_in_plain_words(path):
    """Those that users read: README, the guide, examples, scene files and notebooks."""
    lines = enumerate(path.read_text("utf-8").splitlines(), 1)
    assert [f"{number}: {turn[0]}" for number, line in lines for turn in PLAIN.finditer(line)] == []


def test_names_say_what_they_hold():
    """A text, a message, a title: `told` and `said` may be any of them."""
    found = []
    for path in (path for path in FILES if path.relative_to(ROOT.parent).parts[0] in ("swarm", "tests")):
        if not IN_TEXT.search(path.read_text("utf-8")):
            continue
        for node in ast.walk(parsed(path)):
            is_bound = isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store)
            name = getattr(node, "id", "") or getattr(node, "attr", "") if is_bound else ""
            name = name or (node.arg if isinstance(node, ast.arg) else "")
            name = name or (node.name if isinstance(node, DEFINITIONS) else "")
            found += [f"{path}:{node.lineno}: {name}"] if NAMES.search(name) else []
    assert found == []
