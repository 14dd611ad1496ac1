"""The run of soft balls, which press on one another and on walls in fixed steps."""

from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from .base import BaseRun
from .state import Seeding
from .tally import Watched


class GrainsRun(BaseRun):
    """The run of soft balls, which press on one another and on walls in fixed steps."""

    def __init__(
        self, scene: Scene, particles: Particles, method: Method, threads: int, block_size: int | None, compile: str,
        seeding: Seeding, watched: Watched,
    ) -> None:  # fmt: skip
        raise NotImplementedError
