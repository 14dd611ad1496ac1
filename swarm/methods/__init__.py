"""The methods by their kind in a scene file."""

from .augmented_lagrangian import AugmentedLagrangian
from .base import Method
from .impact import Impact
from .midpoint import Midpoint
from .penalty import Penalty
from .trapezoidal import Trapezoidal
from .verlet import Verlet

__all__ = ["ALL_METHODS", "AugmentedLagrangian", "Impact", "Method", "Midpoint", "Penalty", "Trapezoidal", "Verlet"]

ALL_METHODS: dict[str, type[Method]] = {
    "impact": Impact,
    "penalty": Penalty,
    "augmented-lagrangian": AugmentedLagrangian,
    "verlet": Verlet,
    "midpoint": Midpoint,
    "trapezoidal": Trapezoidal,
}
