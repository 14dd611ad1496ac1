"""Rerun's viewer as a widget of a notebook."""

import contextlib
import io
import os
import socket
from typing import Any

from ..common.extras import needed_by

# The variable for the source of the viewer in the browser, and its default.
_ASSET, _SERVER = "RERUN_NOTEBOOK_ASSET", ("app.rerun.io", 443)
_PATIENCE = 3.0  # [s]
# The height in pixels; the width is that of the cell.
_HEIGHT = 600

# References to the displayed viewers, for the life of the kernel: a viewer without a reference is closed before its
# has begun.
_shown: list[Any] = []


def show(trajectory: Any, particles: int, color: str, megabytes: float) -> None:
    """Show a `Trajectory` below the cell that runs; see `Trajectory.show`."""
    with needed_by("a viewer", "notebook"):
        bring_widget()
        from . import recorded
        from . import writer as recording
    display_below(recorded.record(trajectory, None, recording.Settings(particles, color, megabytes)))


def bring_widget() -> None:
    """Import the widget: on import its module determines the source of the viewer for browsers.

    By default that is Rerun's server. If this machine does not reach it, browsers get it from here, unless the
    environment variable has another value.
    """
    chosen = _ASSET in os.environ or _is_reached()
    if not chosen:
        os.environ[_ASSET] = "serve-local"
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints messages
            import rerun_notebook  # noqa: F401  Rerun imports it late, and says what to install in its own words
    finally:
        if not chosen:
            del os.environ[_ASSET]


def _is_reached() -> bool:
    try:
        socket.create_connection(_SERVER, _PATIENCE).close()
    except OSError:
        return False
    return True


def display_below(stream: Any) -> None:
    """Show the recording of a stream below the cell that runs."""
    from rerun.notebook import Viewer  # which imports half of Jupyter

    viewer = Viewer(width="auto", height=_HEIGHT, recording=stream, theme="light")
    viewer.update_panels(top="hidden")
    viewer.display()
    _shown.append((viewer, stream))
