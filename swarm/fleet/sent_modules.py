"""The code of users that workers of a cluster are sent: that of modules which are not installed."""

import sys
from types import ModuleType

from ..serialization import plugins

# What this process has taken: a module is made once, as an import makes it.
_taken: set[bytes] = set()


def send_code() -> list[str]:
    """Let cloudpickle send the code of the plugins that are not installed, packages included; the modules' names."""
    import cloudpickle

    names = plugins.not_installed()
    for name in names:
        cloudpickle.register_pickle_by_value(sys.modules[name])
        for of_it, module in list(sys.modules.items()):
            if of_it == name or of_it.startswith(f"{name}."):
                _without_caches(of_it, module)
    return names


def _without_caches(name: str, module: ModuleType) -> None:
    """Delete what msgspec keeps in the classes of a module that it made objects of: it cannot be pickled."""
    for kind in vars(module).values():
        if isinstance(kind, type) and kind.__module__ == name and "__msgspec_cache__" in vars(kind):
            del kind.__msgspec_cache__  # type: ignore[attr-defined]


def pickled() -> bytes:
    """The plugins that are not installed."""
    import cloudpickle

    return bytes(cloudpickle.dumps({name: sys.modules[name] for name in send_code()}))


def take(modules: bytes) -> None:
    """Let this process import `pickled` modules that it does not have."""
    import pickle

    if modules not in _taken:
        _taken.add(modules)
        for name, module in pickle.loads(modules).items():
            sys.modules.setdefault(name, module)
