"""Optional packages."""

import contextlib
from collections.abc import Iterator

from .errors import SceneError

_PACKAGES = {
    "record": "rerun-sdk scikit-image contourpy",
    "plot": "matplotlib scikit-image",
    "bodies": "scipy",
    "mesh": "trimesh libigl",
    "table": "pandas",
    "parquet": "pandas pyarrow",
    "xarray": "xarray",
    "animation": "matplotlib scikit-image imageio-ffmpeg",
    "notebook": "'rerun-sdk[notebook]' scikit-image contourpy",
    "cluster": "distributed",
    "gsd": "gsd",
    "report": "jinja2 matplotlib scikit-image",
}


@contextlib.contextmanager
def needed_by(what: str, extra: str) -> Iterator[None]:
    """Imports in this context raise a SceneError that says what to install."""
    try:
        yield
    except ModuleNotFoundError as error:
        if str(error.name).startswith("swarm"):
            raise
        raise SceneError(
            f"{what} needs the package {error.name!r}, which is not installed: pip install {_PACKAGES[extra]}"
        ) from error
