"""The methods by their kinds in a scene file.

To add one, write a file here with a dataclass derived from `Method`, for users, and a record derived from
`MethodNumbers` of contract.py, for kernels: the numbers of a lane (`constants`, `own`), the way to the next contact
(`land` or `flight`), and `contact` in lanes; the part with branches and loops is `hard_pass`. Then name the class in
ALL_METHODS below. examples/own_method.py is a complete method.
"""

from typing import TYPE_CHECKING, Any

from ..common.kinds import Kinds
from .base import Method

if TYPE_CHECKING:
    from .augmented_lagrangian import AugmentedLagrangian
    from .impact import Impact
    from .implicit import Midpoint, Trapezoidal
    from .penalty import Penalty
    from .verlet import Verlet

__all__ = [
    "ALL_METHODS", "AugmentedLagrangian", "Impact", "Method", "Midpoint", "Penalty", "Trapezoidal", "Verlet",
]  # fmt: skip

ALL_METHODS: Kinds[Method] = Kinds(
    __name__,
    {
        "impact": "impact:Impact",
        "penalty": "penalty:Penalty",
        "augmented-lagrangian": "augmented_lagrangian:AugmentedLagrangian",
        "verlet": "verlet:Verlet",
        "midpoint": "implicit:Midpoint",
        "trapezoidal": "implicit:Trapezoidal",
    },
)


def __getattr__(name: str) -> Any:
    return ALL_METHODS.named(name)
