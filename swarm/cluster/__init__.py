"""A run on a cluster: shards of particles, each an ordinary run on a worker, joined into one file."""

from .client import carry_out
from .sharded import Sharded

__all__ = ["Sharded", "carry_out"]
