"""The extras of pyproject.toml have every package that what needs them imports, so that no error names another one."""

import ast
import importlib
import importlib.metadata
import re
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
from conftest import row

import swarm
from swarm import views
from swarm.common.extras import PACKAGES, needed_by
from swarm.exports import export

ROOT = Path(swarm.__file__).parent
PROJECT = tomllib.loads((ROOT.parent / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
KNOWN = importlib.metadata.packages_distributions()
# What others are made of, and bring: Numba, and rerun-sdk[notebook].
BROUGHT = {"llvmlite", "rerun-notebook"}


def named(requirement):
    """The package of a requirement, without its version."""
    return re.split(r"[><=!~]", requirement)[0].strip().lower()


def module_of(path):
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {module_of(path): path for path in ROOT.rglob("*.py")}


@cache
def tree_of(module):
    return ast.parse(FILES[module].read_text("utf-8"))


def is_guarded(node):
    """Whether a statement is one of `with needed_by(...)`, or for type checkers."""
    if isinstance(node, ast.If):
        return "TYPE_CHECKING" in ast.unparse(node.test)
    return isinstance(node, ast.With) and bool(list(extras_of(node)))


def extras_of(node):
    """The extras that a `with needed_by(what, extra)` may name."""
    for item in node.items:
        call = item.context_expr
        if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "needed_by":
            extra = call.args[1]
            ends = [extra.body, extra.orelse] if isinstance(extra, ast.IfExp) else [extra]
            yield from (end.value for end in ends)


def imported(nodes, module, deep):
    """What statements import; `deep`: also within functions, but for what is guarded there."""
    package = module if FILES[module].name == "__init__.py" else module.rpartition(".")[0]
    todo = list(nodes)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: package.count(".") + 2 - node.level] if node.level else []
            base = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" if f"{base}.{alias.name}" in FILES else base for alias in node.names)
        elif not is_guarded(node) and (deep or not isinstance(node, ast.FunctionDef)):
            todo += ast.iter_child_nodes(node)


@cache
def of_module(module):
    """What a module imports when it is imported; of pages and films also the packages of their functions."""
    at_once = set(imported(tree_of(module).body, module, deep=False))
    later = {name for name in imported(tree_of(module).body, module, deep=True) if not name.startswith("swarm")}
    return at_once | later if module.startswith(("swarm.pages", "swarm.pictures.film")) else at_once


def packages(names):
    """The packages that imports come to, through all modules of swarm."""
    seen, todo, found = set(), list(names), set()
    while todo:
        name = todo.pop()
        if name in seen:
            continue
        seen.add(name)
        top = name.partition(".")[0]
        if top == "swarm":
            parents = [name.rsplit(".", k)[0] for k in range(1, name.count(".") + 1)]
            todo += [*parents, *(of_module(name) if name in FILES else ())]
        elif top not in sys.stdlib_module_names:
            found |= {one.lower().replace("_", "-") for one in KNOWN.get(top, [top])}
    return found


def guarded():
    """Of every `with needed_by(what, extra)` its place, the extras that its function has asked for, and its imports."""
    for module in FILES:
        if "needed_by(" not in FILES[module].read_text("utf-8") or module == views.__name__:
            continue
        for function in (node for node in ast.walk(tree_of(module)) if isinstance(node, ast.FunctionDef)):
            before = ()
            for node in (one for one in ast.walk(function) if isinstance(one, ast.With)):
                for extra in extras_of(node):
                    names = set(imported(node.body, module, deep=True))
                    if module == "swarm.exports.export" and "import_module" in ast.unparse(node):
                        forms = [form for kind, form in export._FORMS.items() if (kind == ".gsd") == (extra == "gsd")]
                        names |= {f"swarm.exports.{form}" for form in forms}
                    yield f"{module}:{node.lineno}", (*before, extra), names
                before = (*before, *extras_of(node))
    for name, one in views.VIEWS.items():
        yield f"{views.__name__}, {name}", () if one.extra is None else (one.extra,), {f"swarm{one.module}"}


CORE = {named(one) for one in PROJECT["dependencies"]} | BROUGHT


def test_the_sentences_name_the_packages_of_the_extras():
    for extra, text in PACKAGES.items():
        assert sorted(map(named, EXTRAS[extra])) == sorted(text.split()), extra


def test_the_extra_for_tests_has_all_others():
    """But those for a browser, and what is in a package that it has."""
    tested = {named(one).partition("[")[0] for one in EXTRAS["test"]}
    brought = {"cloudpickle", "contourpy", "markupsafe", "pillow"}
    for extra in PACKAGES:
        assert {named(one).partition("[")[0] for one in EXTRAS[extra]} <= tested | brought, extra


def test_what_is_imported_is_in_the_extra():
    count = 0
    for place, asked, names in guarded():
        with row(place, *asked):
            given = {name.partition("[")[0] for extra in asked for name in PACKAGES[extra].split()}
            assert names
            assert packages(names) <= given | CORE
        count += 1
    assert count > len(PACKAGES)


def test_what_is_imported_without_an_extra_is_a_dependency():
    assert packages(["swarm", "swarm.commands.cli", *(f"swarm.{home}" for home in swarm._HOME.values())]) <= CORE


def test_the_sentence():
    message = (
        r"^a page needs the package 'nothing', which is not installed: pip install jinja2 markupsafe .*, or in swarm's "
        r"folder the extra 'report': pip install \"\.\[report\]\"$"
    )
    with pytest.raises(swarm.SceneError, match=message), needed_by("a page", "report"):
        importlib.import_module("nothing.within")
    with pytest.raises(ModuleNotFoundError), needed_by("a page", "report"):
        importlib.import_module("swarm.nothing")


def test_a_mesh_without_scipy_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy", None)
    monkeypatch.delitem(sys.modules, "scipy.spatial", raising=False)
    corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    with pytest.raises(swarm.SceneError, match=r"a mesh needs the package 'scipy'.*: pip install trimesh libigl"):
        swarm.Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
