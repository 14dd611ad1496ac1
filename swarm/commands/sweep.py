"""`swarm sweep`: carry out the runs of a sweep file."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from ..common import interrupt
from ..errors import SwarmError
from .options import Option, Positional
from .shown import EXIT_CODES, REASONS, Cluster, Plugins, Quiet, Walltime, command_again, table

if TYPE_CHECKING:
    from ..fleet.sweeping import Outcome

_FAILED = 1
# The largest number of failures that are printed; the table has all.
_SHOWN = 5


def sweep(  # noqa: PLR0913  one argument an option
    sweep_file: Annotated[Path, Positional(metavar="SWEEP.toml", help="A scene file with a [sweep] table.")],
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FOLDER", help="Of all files [default: SWEEP, here].")
    ] = None,
    processes: Annotated[
        int | None, Option(help="Runs at the same time [default: all cores]; results do not depend on it.")
    ] = None,
    threads: Annotated[int | None, Option(help="Threads of a run [default: the cores for each].")] = None,
    written: Annotated[str, Option("--table", metavar="KIND", help="Table of the results: csv or parquet.")] = "csv",
    overwrite: Annotated[bool, Option("--overwrite", help="Replace the runs that the folder holds.")] = False,
    quiet: Quiet = False,
    resume: Annotated[
        bool, Option("--resume", help="Go on with the runs that the folder holds; those done are not run again.")
    ] = False,
    walltime: Walltime = None,
    cluster: Cluster = None,
    plugins: Plugins = None,
    as_json: Annotated[
        bool, Option("--json", help="Print the outcome of the sweep as JSON, also if it fails.")
    ] = False,
) -> None:
    """Carry out the runs of a sweep file, and write one table of their results."""
    first, interrupts = None, list[bool]()
    try:
        # An interrupt here waits: the process that has started must end first.
        with interrupt.taken_by(lambda: interrupts.append(True)), interrupt.importing():
            if cluster is None:
                from ..fleet.processes import Place

                first = Place()
                first.start()
            from ..common.checks import duration
            from ..fleet import sweeping

        if interrupts:
            raise KeyboardInterrupt
        latest = None if walltime is None else duration("--walltime", walltime)
        options = sweeping.SweepOptions(
            output, processes, threads, resume, overwrite, not quiet, written, latest, tuple(plugins or ()), cluster
        )
        outcome = sweeping.carry_out_sweep(sweep_file, options, first)
    except KeyboardInterrupt:  # the second one
        print("interrupted; with --resume, runs that were under way go on from their last checkpoints", file=sys.stderr)
        if as_json:
            print(json.dumps({"status": "interrupted"}))
        raise click.exceptions.Exit(EXIT_CODES["interrupted"]) from None
    except SwarmError as error:
        if as_json:
            print(json.dumps({"status": "failed", "error": str(error)}))
        raise
    finally:
        if first is not None:
            first.close()
    with interrupt.at_once():
        _report(outcome, quiet, as_json)
    if outcome.stopped:
        raise click.exceptions.Exit(EXIT_CODES[outcome.stopped])
    if outcome.results.of_state("failed"):
        raise click.exceptions.Exit(_FAILED)


def _report(outcome: "Outcome", quiet: bool, as_json: bool) -> None:
    from ..fleet.plan import in_one_line

    results = outcome.results
    numbers = {state: len(results.of_state(state)) for state in ("done", "failed", "waiting")}
    failures = [
        (results.trajectory(variant).name, variant.parameters, (status or {})["error"])
        for variant, status in results.of_state("failed")
    ]
    again = command_again() if outcome.stopped else None
    if again is not None:
        message = f"{REASONS[outcome.stopped]}: {numbers['waiting']} runs are left; resume with\n  {again}"
        print(message, file=sys.stderr)
    if others := results.others():
        print(
            f"{results.folder} also holds {len(others)} run{'s' * (len(others) > 1)} that {results.plan.path} does not "
            f"have, such as {others[0]}.h5",
            file=sys.stderr,
        )
    if as_json:
        status = outcome.stopped or ("failed" if failures else "complete")
        failure_rows = [dict(zip(("file", "parameters", "error"), one, strict=True)) for one in failures]
        more: dict[str, Any] = {"table": str(results.path), "wall_time": outcome.wall_time, "failures": failure_rows}
        print(json.dumps({"status": status, **numbers, **more, "resume": again}, indent=2, default=str))
    elif not quiet:
        shown = [f"{file}, {in_one_line(parameters)}: {error}" for file, parameters, error in failures[:_SHOWN]]
        more_failures = [f"and {len(failures) - _SHOWN} more, in the table"] if len(failures) > _SHOWN else []
        rows = {"runs": ", ".join(f"{count} {state}" for state, count in numbers.items() if count)}
        rows |= {"failed": "\n".join(shown + more_failures)} if failures else {}
        table({**rows, "wall time": f"{outcome.wall_time:.2f} s", "table": str(results.path)})
