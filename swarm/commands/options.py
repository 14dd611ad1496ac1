"""Commands made from functions: a parameter is annotated with its type, its command-line names, and its help."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import click

_INTERRUPTED = 130


class Option:
    """An option with these names, or with the name of its parameter."""

    def __init__(self, *names: str, **more: Any) -> None:
        self.names, self.more = names, more

    def parameter(self, name: str, kind: Any, default: Any) -> click.Parameter:
        """Return the option of click for a parameter of a function; required if the parameter has no default."""
        more = {"required": True} if default is inspect.Parameter.empty else {"default": default}
        more |= {"is_flag": True} if kind is bool else {"type": _type_of(kind), "multiple": kind == list[str]}
        return click.Option([*(self.names or [f"--{name}"]), name], **more, **self.more)


class Positional:
    """A required argument."""

    def __init__(self, metavar: str, help: str) -> None:
        self.metavar, self.help = metavar, help

    def parameter(self, name: str, kind: Any, default: Any) -> click.Parameter:
        """Return the argument of click for a parameter of a function."""
        return click.Argument([name], type=_type_of(kind), metavar=self.metavar, help=self.help)


def _type_of(kind: Any) -> Any:
    return click.Path(path_type=Path) if kind is Path else str if kind == list[str] else kind


class _Interruptible(click.Command):
    """A command that ends with the exit code 130 after an interrupt, as a shell expects."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise click.exceptions.Exit(_INTERRUPTED) from None


class Group(click.Group):
    """Commands, listed in the order of their addition."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands."""
        return list(self.commands)

    def add(self, function: Callable[..., None], epilog: str, short_help: str | None = None) -> None:
        """Add the command with the name, the parameters and the docstring of a function."""
        parameters = []
        for name, one in inspect.signature(function).parameters.items():
            kind, given = get_args(one.annotation)
            parameters.append(given.parameter(name, (*get_args(kind), kind)[0], one.default))  # without "or None"
        self.add_command(
            _Interruptible(
                function.__name__, callback=function, params=parameters, help=function.__doc__, epilog=epilog,
                short_help=short_help,
            )
        )  # fmt: skip
