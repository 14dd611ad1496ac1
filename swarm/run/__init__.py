"""The package of runs, which is also the function `swarm.run` that carries out a scene file.

    swarm.run(path, output=None, *, plugins=(), **options) -> swarm.Result

`path` is the scene file, `output` the trajectory to write, `plugins` the
modules with code that the file may name, and `options` are keywords of
`swarm.simulate` in place of the keys of [run]:

    result = swarm.run("scene.toml", until=2.0)
"""

import pkgutil
import sys
from types import ModuleType
from typing import Any


class _Called(ModuleType):
    """This package as a callable, as a function named `run` would hide its modules, or be hidden by them."""

    def __call__(self, path: Any, output: Any = None, *, plugins: Any = (), **options: Any) -> Any:
        """Carry out the run of a scene file; see the function of `authoring.file_run`."""
        from .engines import wing  # Numba is loaded only for a run

        return wing("authoring.file_run").run(path, output, plugins=plugins, **options)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the package by its name, as any module that code for a cluster refers to."""
        return pkgutil.resolve_name, (self.__name__,)


sys.modules[__name__].__class__ = _Called
