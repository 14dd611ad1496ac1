"""The methods by their kind in a scene file."""

from .augmented_lagrangian import AugmentedLagrangian
from .base import Method
from .impact import Impact
from .penalty import Penalty

__all__ = ["ALL_METHODS", "AugmentedLagrangian", "Impact", "Method", "Penalty"]

ALL_METHODS: dict[str, type[Method]] = {
    "impact": Impact,
    "penalty": Penalty,
    "augmented-lagrangian": AugmentedLagrangian,
}
