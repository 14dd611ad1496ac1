"""Tables of classes by their kinds in files; the module of a class is loaded when the class is first needed."""

import importlib
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

T = TypeVar("T")


class Kinds(Mapping[str, type[T]]):
    """Classes by their kinds.

    Args:
        package: the package of the table.
        homes: kind -> the module in the package, a colon, and the class.

    >>> from swarm.surfaces import ALL_SURFACES
    >>> ALL_SURFACES["sphere"].__name__, ALL_SURFACES.kind_of(ALL_SURFACES["torus"])
    ('Sphere', 'torus')
    """

    def __init__(self, package: str, homes: Mapping[str, str]) -> None:
        self._package, self.homes = package, homes

    def __getitem__(self, kind: str) -> type[T]:
        """Return the class of a kind."""
        module, _, name = self.homes[kind].partition(":")
        found: type[T] = getattr(importlib.import_module(f"{self._package}.{module}"), name)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self.homes)

    def __len__(self) -> int:
        return len(self.homes)

    def kind_of(self, cls: type) -> str | None:
        """Return the kind of a class; None if it is not in the table."""
        home = f"{cls.__module__}:{cls.__qualname__}"
        return next((kind for kind, mine in self.homes.items() if home == f"{self._package}.{mine}"), None)

    def named(self, name: str) -> Any:
        """Return the class of this name, for `__getattr__` of the package."""
        for kind, home in self.homes.items():
            if home.endswith(f":{name}"):
                return self[kind]
        raise AttributeError(f"module {self._package!r} has no attribute {name!r}")
