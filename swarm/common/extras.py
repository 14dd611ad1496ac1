"""Optional packages."""

import contextlib
import shlex
from collections.abc import Iterator

from ..errors import SceneError

# The packages that draw walls.
_DRAWN = "contourpy scikit-image scipy"
# The packages of each extra of pyproject.toml: all that may be missing in an import within `needed_by`.
PACKAGES = {
    "record": f"rerun-sdk {_DRAWN}",
    "plot": f"matplotlib {_DRAWN}",
    "bodies": "scipy",
    "mesh": "trimesh libigl lxml networkx scipy",
    "table": "pandas",
    "parquet": "pandas pyarrow",
    "xarray": "xarray",
    "animation": f"matplotlib imageio-ffmpeg pillow {_DRAWN}",
    "notebook": f"rerun-sdk[notebook] {_DRAWN}",
    "cluster": "distributed cloudpickle",
    "gsd": "gsd",
    "report": f"jinja2 markupsafe matplotlib pillow {_DRAWN}",
}


@contextlib.contextmanager
def needed_by(what: str, extra: str) -> Iterator[None]:
    """Raise a SceneError with the package to install if an import in this context fails."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        if package == "swarm":
            raise
        raise SceneError(
            f"{what} needs the package {package!r}, which is not installed: pip install "
            f"{' '.join(map(shlex.quote, PACKAGES[extra].split()))}, or in swarm's folder the extra {extra!r}: "
            f'pip install ".[{extra}]"'
        ) from error
