"""The methods by their kind in a scene file.

To add one, write a file here with a dataclass derived from `Method`, for users, and a record derived from
`MethodNumbers` of contract.py, for kernels: what a lane keeps (`constants`, `own`), the way to the next contact (`land`
or `flight`), and `contact` in lanes; what needs branches and loops is `hard_pass`. Then name the class in ALL_METHODS
below. examples/own_method.py is a complete method.
"""

from .augmented_lagrangian import AugmentedLagrangian
from .base import Method
from .impact import Impact
from .implicit import Midpoint, Trapezoidal
from .penalty import Penalty
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
