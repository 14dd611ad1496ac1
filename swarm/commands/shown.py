"""The common parts of several commands: arguments, output, and the command that resumes a run."""

import itertools
import shlex
import sys
from pathlib import Path
from typing import Annotated

from .options import Option, Positional

TrajectoryFile = Annotated[Path, Positional(metavar="FILE.h5", help="A trajectory.")]
Picture = Annotated[Path | None, Option("-o", "--output", metavar="OUT.png", help="Picture [default: FILE.png].")]
Plugins = Annotated[
    list[str] | None, Option("--plugins", metavar="MODULE", help="Allow the file to name code of this module.")
]
Walltime = Annotated[
    str | None, Option(metavar="TIME", help="Stop after this time, such as 2h, with a checkpoint; the exit code is 75.")
]
Cluster = Annotated[
    str | None, Option(metavar="WHERE", help="Run on a cluster: local:N, N workers here, or tcp://HOST:PORT of Dask.")
]
Quiet = Annotated[bool, Option("--quiet", help="No progress bar and no summary.")]

# Exit codes of stopped runs. 130 is that of a shell for SIGINT. 75 is EX_TEMPFAIL of sysexits.h, "try again
# later": the wall time is over, and a chain of jobs needs another job.
EXIT_CODES = {"interrupted": 130, "walltime": 75}
REASONS = {"interrupted": "interrupted", "walltime": "the wall time limit is reached"}


def written(path: Path) -> None:
    """Print the path and the size of a written file."""
    print(f"written to {path} ({path.stat().st_size / 1e6:.1f} MB)")


def command_again() -> str:
    """The command line that resumes this run: this one with --resume, without options that contradict it."""
    again = [
        word
        for before, word in itertools.pairwise(["", *sys.argv[1:]])
        if word.partition("=")[0] not in ("--overwrite", "--resume", "--live", "--record") and before != "--record"
    ]
    return shlex.join(["swarm", *again, "--resume"])


def table(rows: dict[str, str]) -> None:
    """Print rows of names and values."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in rows.items():
        table.add_row(name, value)
    Console(highlight=False, markup=False).print(table)
