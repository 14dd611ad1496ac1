"""The command line: the commands, and the exit codes of errors and signals."""

import sys

import click

from ..common import interrupt
from ..errors import SceneError, SwarmError
from ..version import VERSION
from .options import Group
from .pictures import animate, plot, record, report, view
from .run import run
from .scenes import check, docs, new, schema
from .sweep import sweep
from .trajectories import export, info

_FAILED, _BAD_INPUT = 1, 2
_CODES = "Exit codes: 0 done, 1 a run failed, 2 bad input, 75 the wall time is over (--resume goes on), 130 interrupted"


def _version(ctx: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        print(f"swarm {VERSION}")
        ctx.exit()


app = Group(
    no_args_is_help=True,
    help="Simulate particles and bodies bouncing in rigid cavities and off solids, with energy conserved to round-off.",
    epilog=f"Examples:  swarm run examples/scenes/cavity.toml  |  swarm info cavity.h5\n\n{_CODES}",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110, "show_default": True},
    params=[
        click.Option(
            ["--version"], is_flag=True, callback=_version, is_eager=True, expose_value=False,
            help="Print the version and exit.",
        )
    ],
)  # fmt: skip
app.add(new, epilog="Example:  swarm new cavity && swarm run cavity.toml")
app.add(
    check,
    short_help="Say what a scene file will do, without running it.",
    epilog="Example:  swarm check examples/scenes/cavity.toml",
)
app.add(run, epilog=f"Example:  swarm run examples/scenes/cavity.toml -o cavity.h5 --threads 2\n\n{_CODES}")
app.add(
    sweep,
    short_help="Carry out the runs of a sweep file, with a table of results.",
    epilog=f"Example:  swarm sweep examples/sweeps/cooling.toml -o cooling\n\n{_CODES}",
)
app.add(info, epilog="Example:  swarm info cavity.h5, or swarm info --repair cavity.rrd")
app.add(record, epilog="Example:  swarm record cavity.h5 -o cavity.rrd")
app.add(
    view,
    short_help="Draw a contact sheet of a recording, without a screen.",
    epilog="Example:  swarm view cavity.rrd -o cavity.png --times 0,5,10",
)
app.add(
    plot,
    short_help="Draw energies, impacts, speeds and particles of a trajectory.",
    epilog="Example:  swarm plot cavity.h5 -o cavity.png",
)
app.add(
    report,
    short_help="Make a page of a run or a sweep for any browser.",
    epilog="Example:  swarm report cavity.h5 -o cavity.html, or swarm report FOLDER of a sweep",
)
app.add(
    animate,
    short_help="Make a film of a trajectory.",
    epilog="Example:  swarm animate cavity.h5 -o cavity.mp4 --frames 100",
)
app.add(
    export,
    short_help="Write a trajectory for ParaView, OVITO, Blender and others.",
    epilog="Example:  swarm export cavity.h5 -o cavity.vtkhdf --frames ::10",
)
app.add(
    schema,
    short_help="Write the JSON Schema of scene files, for editors.",
    epilog="Example:  swarm schema -o swarm.schema.json, and #:schema ./swarm.schema.json in a file",
)
app.add(
    docs,
    short_help="Write the reference as pages for a browser.",
    epilog="Example:  swarm docs -o reference, then open reference/index.html",
)


def main() -> None:
    """Run the command line. Its exit codes are `_CODES`."""
    try:
        app()
    except SwarmError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(_BAD_INPUT if isinstance(error, SceneError) else _FAILED)
    finally:
        interrupt.leave_at_once()
