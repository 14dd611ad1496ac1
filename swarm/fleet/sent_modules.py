"""The code of users that is sent to the workers of a cluster: modules that are not installed."""

import sys
from types import ModuleType

from ..serialization import plugins

# Modules that this process has taken: a module is created once, as by an import.
_taken: set[bytes] = set()


def send_code() -> list[str]:
    """Let cloudpickle send the code of plugins that are not installed, and their packages; return their names."""
    import cloudpickle

    names = plugins.not_installed()
    for name in names:
        cloudpickle.register_pickle_by_value(sys.modules[name])
        for of_it, module in list(sys.modules.items()):
            if of_it == name or of_it.startswith(f"{name}."):
                _without_caches(of_it, module)
    return names


def _without_caches(name: str, module: ModuleType) -> None:
    """Delete msgspec's caches in the classes of a module of which it made objects: they cannot be pickled."""
    for kind in vars(module).values():
        if isinstance(kind, type) and kind.__module__ == name and "__msgspec_cache__" in vars(kind):
            del kind.__msgspec_cache__  # type: ignore[attr-defined]


def pickled() -> bytes:
    """Return the plugins that are not installed as bytes."""
    import cloudpickle

    return bytes(cloudpickle.dumps({name: sys.modules[name] for name in send_code()}))


def take(modules: bytes) -> None:
    """Let this process import modules from `pickled` that it does not have."""
    import pickle

    if modules not in _taken:
        _taken.add(modules)
        for name, module in pickle.loads(modules).items():
            sys.modules.setdefault(name, module)
