"""The views of a run, each with a module that is imported when the view is used."""

import importlib
from types import ModuleType
from typing import NamedTuple

from .common.extras import needed_by


class View(NamedTuple):
    """A module that shows a run, and the packages that it needs.

    Attributes:
        module: the name of the module, relative to this package.
        what: the form in which it shows a run, for errors.
        extra: the packages that it needs, see `extras.PACKAGES`; None for no packages.
    """

    module: str
    what: str = ""
    extra: str | None = None


VIEWS = {
    "bodies": View(".bodies.table"),
    "content": View(".words.content"),
    "facts": View(".words.facts"),
    "export": View(".exports.export"),
    "plot": View(".pictures.plots", "a plot", "plot"),
    "animation": View(".pictures.film", "a film", "animation"),
    "film": View(".pictures.shown_film", "a film", "animation"),
    "recording": View(".recording.writer", "a recording", "record"),
    "report": View(".pages.of_run", "a report", "report"),
    "xarray": View(".exports.labelled", "a Dataset", "xarray"),
    "viewer": View(".recording.recorded", "a viewer", "record"),
    "notebook": View(".recording.widget", "a viewer", "notebook"),
}


def view(name: str) -> ModuleType:
    """Return the module of a view.

    Raises:
        SceneError: a package that the view needs is not installed.

    >>> view("plot").__name__
    'swarm.pictures.plots'
    """
    found = VIEWS[name]
    if found.extra is None:
        return importlib.import_module(found.module, __package__)
    with needed_by(found.what, found.extra):
        return importlib.import_module(found.module, __package__)
