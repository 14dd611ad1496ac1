"""`swarm docs`: the reference, as pages for a browser."""

from pathlib import Path
from typing import Annotated, Any

import click

from .options import Option


def docs(
    folder: Annotated[
        Path, Option("-o", "--output", metavar="FOLDER", help="Of the pages; index.html is the first.")
    ] = Path("swarm-docs"),
    overwrite: Annotated[bool, Option("--overwrite", help="Replace the pages that the folder holds.")] = False,
) -> None:
    """Write the reference: pages of all public names, observables, keys of scene files and commands."""
    from ..authoring.reference import write

    print(f"written to {write(folder, commands(click.get_current_context().find_root().command), overwrite)}")


def commands(group: Any) -> tuple[Any, ...]:
    """Every command of the command line, with its arguments and options."""
    from ..authoring.reference import Command

    found = []
    for name, command in group.commands.items():
        options = tuple(_option(one) for one in command.params if one.name != "help")
        about = " ".join((command.help or "").split())
        found.append(Command(name, about, options, (command.epilog or "").partition("\n")[0]))
    return tuple(found)


def _option(one: Any) -> tuple[str, str, str]:
    """The names of an argument or option, its default, and what it is."""
    if one.param_type_name == "argument":
        return one.metavar or one.name.upper(), "needed", one.help or ""
    names = ", ".join([*one.opts, *one.secondary_opts])
    default = "" if one.default in (None, False) else str(one.default)
    return names, default, one.help or ""
