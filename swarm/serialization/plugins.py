"""Code that scene files name, as "module:Name", only of modules that the command line or the caller allows."""

import contextlib
import importlib
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from ..common.checks import closest, list_of, shown
from ..errors import SceneError

_ALLOWED: ContextVar[tuple[str, ...]] = ContextVar("_ALLOWED", default=())
_MODULE = r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*"
# The names of the imported modules.
imported: set[str] = set()
# Folders that packages are installed in.
_INSTALLED = {"site-packages", "dist-packages"}
_NAMED = re.compile(rf"({_MODULE}):([A-Za-z_]\w*)")


def checked_modules(given: Any) -> tuple[str, ...]:
    """Return the names of modules, from a list of them, or of texts with commas.

    Raises:
        SceneError: a name is not that of a module.
    """
    modules = list_of("plugins", given, 'names of modules, such as ["mylaws"]')
    found = []
    for one in modules:
        for name in one.split(",") if isinstance(one, str) else [one]:
            if not isinstance(name, str) or not re.fullmatch(_MODULE, name.strip()):
                raise SceneError(f"plugins must be names of modules, such as mylaws, without .py, got {shown(name)}")
            found.append(name.strip())
    return tuple(dict.fromkeys(found))


@contextlib.contextmanager
def allowed(given: Iterable[str]) -> Iterator[None]:
    """Allow files to name objects of these modules; they are imported, also from the current folder.

    Raises:
        SceneError: there is no such module, or it raises an error.
    """
    names = checked_modules(given)
    for name in names:
        _imported(name)
    token = _ALLOWED.set(names)
    try:
        yield
    finally:
        _ALLOWED.reset(token)


def _imported(name: str) -> Any:
    """Import a module, which may be in the current folder."""
    here = os.getcwd()
    added = here not in sys.path
    if added:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(name)
        imported.add(name)
        return module
    except ModuleNotFoundError as error:
        if error.name is None or not (name == error.name or name.startswith(f"{error.name}.")):
            raise SceneError(f"plugins: the module {name} cannot be imported: {error}") from error
        raise SceneError(
            f"plugins: there is no module {name}, neither in the current folder, {here}, nor among those that are "
            "installed"
        ) from None
    except Exception as error:
        raise SceneError(f"plugins: the module {name} cannot be imported: {type(error).__name__}: {error}") from error
    finally:
        if added:
            sys.path.remove(here)


def files() -> dict[str, Path]:
    """The files of the imported modules, by name."""
    found = {name: getattr(sys.modules.get(name), "__file__", None) for name in sorted(imported)}
    return {name: Path(file) for name, file in found.items() if file is not None}


def not_installed() -> list[str]:
    """The names of the imported modules that are neither installed nor part of Python or of this package."""
    apart = {*sys.stdlib_module_names, __package__.partition(".")[0]}
    return [
        name for name, file in files().items() if name.partition(".")[0] not in apart and not _INSTALLED & {*file.parts}
    ]


def is_named(text: Any) -> bool:
    """Whether a value of a file names code."""
    return isinstance(text, str) and _NAMED.fullmatch(text) is not None


def is_allowed(text: str) -> bool:
    """Whether the module of named code is allowed now."""
    return text.partition(":")[0] in _ALLOWED.get()


def named(where: str, text: Any, what: str) -> Any:
    """Return the object that a value of a file names; `where` is its key, `what` the expected kind.

    Raises:
        SceneError: the value does not name code, the module is not allowed, or the module has no object of that name.
    """
    match = _NAMED.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise SceneError(f'{where}: expected {what} as "module:Name", got {shown(text)}')
    module, name = match.groups()
    if module not in _ALLOWED.get():
        raise SceneError(
            f"{where}: {text} is code of the module {module}, which no file runs by itself; allow it by its name: "
            f'--plugins {module}, or plugins=["{module}"] in Python'
        )
    found = _imported(module)
    if not hasattr(found, name):
        raise SceneError(f"{where}: the module {module} has no {name}{closest(name, vars(found))}")
    return getattr(found, name)


def class_of(where: str, text: Any, base: type[Any], what: str) -> Any:
    """Return the class that a value of a file names, derived from `base`."""
    found = named(where, text, what)
    if not (isinstance(found, type) and issubclass(found, base)):
        raise SceneError(f"{where}: {text} must be {what}, derived from {base.__name__}, got {shown(found)}")
    return found
