"""The run of balls that meet one another and walls at instants."""

from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from .base import BaseRun
from .state import Seeding
from .tally import Watched


class CollidingRun(BaseRun):
    """The run of balls that meet one another and walls at instants."""

    def __init__(
        self, scene: Scene, particles: Particles, method: Method, threads: int, block_size: int | None, compile: str,
        seeding: Seeding, watched: Watched,
    ) -> None:  # fmt: skip
        raise NotImplementedError
