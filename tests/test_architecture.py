"""The architecture: layers of imports, a core that imports no wing, and folders that can be looked through."""

import ast
import functools
import graphlib
import importlib
import re
import warnings
from collections import Counter
from pathlib import Path

import pytest
from conftest import row

import swarm
from swarm import moved, surfaces
from swarm.methods import ALL_METHODS
from swarm.surfaces.laws import ALL_LAWS

pytestmark = pytest.mark.quick

PACKAGE = Path(swarm.__file__).parent
# From the top down; a module imports only from layers below its own, or from its own package. `check` and `numbers` of
# a method take the Scene and the Particles, so these are below.
# Engines of bodies, balls and grains, commands, and what shows runs: the core imports none of them.
WINGS = [
    ["__main__"],
    ["commands"],
    ["authoring"],
    ["fleet"],
    ["scene_file"],
    ["exports", "pages", "recording"],
    ["pictures"],
    ["triangles"],
    ["words"],
    ["events", "history"],
    ["grains"],
    ["bodies"],
]
CORE = [
    ["run"],
    ["files"],
    ["lanes", "placing", "serialization"],
    ["ball_numbers", "methods", "observables", "sources"],
    ["scene"],
    ["compiled_scene"],
    ["contact"],
    ["surfaces"],
    ["motion", "pairs", "particles", "views"],
    ["__init__", "common"],
    ["kernel"],
    ["errors", "moved", "state", "version"],
]
LAYERS = WINGS + CORE
LAYER = {name: depth for depth, names in enumerate(LAYERS) for name in names}
# What the core reaches of wings it reaches by these modules alone, which load by name: the choice of an engine, and the
# table of views. The kinds of surfaces are a table too, which has those of data and formulas.
LOADERS = {("run", "engines"), ("views",)}
# Of a table of kinds it loads modules of the package that has the table.
LOADER_OF_KINDS = ("common", "kinds")
# Modules of Numba and of users, and modules by their earlier names.
LOADERS_OF_OTHERS = {("kernel", "jit"), ("serialization", "plugins"), ("moved",)}
KINDS = ("surfaces", "__init__")
WINGS_OF_SURFACES = ("data", "formulas")


@functools.cache
def modules():
    """Every module of the package as its path of names."""
    return {path.relative_to(PACKAGE).with_suffix("").parts: path for path in PACKAGE.rglob("*.py")}


def statements(body):
    """Every statement in a body and in what it holds, but what is there for types alone."""
    for node in body:
        yield node
        for inner in ("body", "orelse", "finalbody", "handlers", "cases"):
            if inner != "body" or not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)):
                yield from statements(getattr(node, inner, ()))


@functools.cache
def imported(parts):
    """The modules of the package that a module imports, at its top or inside a function, but for types alone."""
    known, found = modules(), []
    for node in statements(ast.parse(known[parts].read_text()).body):
        if isinstance(node, ast.Import):
            assert not any(alias.name.split(".")[0] == "swarm" for alias in node.names), "relative imports only"
        if isinstance(node, ast.ImportFrom) and node.level:
            home = (*parts[: len(parts) - node.level], *(node.module.split(".") if node.module else ()))
            for alias in node.names:
                targets = [(*home, alias.name), (*home, alias.name, "__init__"), home, (*home, "__init__")]
                found.append(next(target for target in targets if target in known))
    return found


def test_a_module_imports_only_from_below():
    for parts in modules():
        with row(".".join(parts)):
            above = [one for one in imported(parts) if LAYER[one[0]] <= LAYER[parts[0]]]
            assert [".".join(one) for one in above if len(one) == 1 or one[0] != parts[0]] == []


def test_no_imports_go_in_circles():
    graph = {parts: set(imported(parts)) for parts in modules()}
    assert len(list(graphlib.TopologicalSorter(graph).static_order())) >= len(modules())


def test_the_core_imports_no_wing():
    """By layers it could not import them at its top; modules that are loaded by name are named in two places only."""
    wings = {name for names in WINGS for name in names}
    for parts, path in modules().items():
        with row(".".join(parts)):
            if parts[0] not in wings and parts != ("__init__",):
                assert [one for one in imported(parts) if one[0] in wings] == []
                if parts not in {*LOADERS, LOADER_OF_KINDS}:
                    assert "importlib.import_module" not in path.read_text() or parts[0] in (
                        "kernel",
                        "serialization",
                        "moved",
                    )
            if parts[0] == "surfaces" and parts[1] not in WINGS_OF_SURFACES and parts != KINDS:
                assert [one for one in imported(parts) if one[0] == "surfaces" and one[1] in WINGS_OF_SURFACES] == []


def test_kinds_are_classes_of_the_package_that_has_their_table():
    tables = {"surfaces": surfaces.ALL_SURFACES, "surfaces.laws": ALL_LAWS, "methods": ALL_METHODS}
    for package, table in tables.items():
        for kind, cls in table.items():
            with row(package, kind):
                assert cls.__module__.startswith(f"swarm.{package}.")
                assert table.kind_of(cls) == kind
                assert getattr(importlib.import_module(f"swarm.{package}"), cls.__name__) is cls
    with pytest.raises(AttributeError, match=r"'swarm\.methods' has no attribute 'Euler'"):
        importlib.import_module("swarm.methods").Euler  # noqa: B018


def test_no_module_has_a_public_name():
    """Importing it would hide the function or the class: `swarm.report`. The package `run` may itself be called."""
    assert {parts[0] for parts in modules()} & set(swarm.__all__) == {"run"}
    assert callable(swarm.run)
    assert swarm.run.__name__ == "swarm.run"


def test_folders_can_be_looked_through():
    """Modules at the root: at most 15; in any one folder: at most 25."""
    folders = Counter(parts[:-1] for parts in modules())
    assert folders[()] <= 15
    assert {folder: count for folder, count in folders.items() if count > 25} == {}


def test_the_page_has_the_folders_the_files_and_the_engines_that_there_are():
    page = (PACKAGE.parent / "examples" / "guide" / "architecture.md").read_text()
    for path in re.findall(r"`((?:[a-z_]+/)*[a-z_]+(?:/|\.py))", page):
        with row(path):
            assert any(PACKAGE.rglob(path)) or (PACKAGE.parent / path).exists()
    named = set(re.findall(r"`([a-z_]+)/", page))
    assert {parts[0] for parts in modules() if len(parts) > 1} - named == set()
    chosen = set(re.findall(r"\b([A-Z]\w*Run|Run)\b", (PACKAGE / "run" / "engines.py").read_text()))
    assert chosen - {"BaseRun"} == set(re.findall(r"\b([A-Z]\w*Run|Run)`", page)) - {"BaseRun"}


@pytest.mark.parametrize("name", ["swarm.output.style", "swarm.packing", "swarm.colliding.cells", "swarm.run.cluster"])
def test_a_module_is_found_by_its_earlier_name(name):
    with warnings.catch_warnings(record=True, action="always") as caught:
        found = importlib.import_module(name)
    assert f"the module {name} is now {moved.present_name(name)}" in [str(one.message) for one in caught]
    assert found is importlib.import_module(moved.present_name(name))
    assert found.__spec__.name == found.__name__ == moved.present_name(name)


def test_every_earlier_name_has_a_module():
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        for name, present in moved.MOVED.items():
            with row(name):
                assert importlib.util.find_spec(present) is not None
                assert importlib.util.find_spec(name) is not None


def classes(folder):
    """The classes at the top of the modules in a folder, and the names of the bases of each."""
    trees = (ast.parse(path.read_text()) for path in sorted((PACKAGE / folder).rglob("*.py")))
    found = (node for tree in trees for node in tree.body if isinstance(node, ast.ClassDef))
    return {node.name: {ast.unparse(base) for base in node.bases} for node in found}


def test_a_surface_is_asked_by_its_contract():
    """What is asked of a surface is a method of it, so that a new one needs no line elsewhere."""
    bases = classes("surfaces")
    shapes = {"Surface", *classes("surfaces/shapes")}
    while more := {name for name, given in bases.items() if given & shapes} - shapes:
        shapes |= more
    found, named = [], re.compile(rf"(isinstance|issubclass|case)\b[^:]*\b({'|'.join(sorted(shapes))})\b")
    for parts, path in modules().items():
        text = path.read_text() if parts[0] != "surfaces" else ""
        for node in ast.walk(ast.parse(text)) if named.search(text) else ():
            asks = isinstance(node, ast.Call) and ast.unparse(node.func) in ("isinstance", "issubclass")
            kinds = [node.args[1]] if asks else [node.cls] if isinstance(node, ast.MatchClass) else []
            if shapes & {name for kind in kinds for name in re.findall(r"\w+", ast.unparse(kind))}:
                found.append(f"{'.'.join(parts)}: {ast.unparse(node)}")
    assert len(found) <= 20, found
