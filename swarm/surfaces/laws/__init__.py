"""Laws of walls: each is a `WallLaw`, as a user-defined law is."""

from typing import TYPE_CHECKING, Any

from ...common.kinds import Kinds

if TYPE_CHECKING:
    from .absorb import Absorb
    from .cercignani_lampis import CercignaniLampis
    from .lambert import Lambert
    from .sticky import Sticky

__all__ = [
    "ALL_LAWS", "Absorb", "CercignaniLampis", "Lambert", "Sticky",
]  # fmt: skip

ALL_LAWS: Kinds[Any] = Kinds(
    __name__,
    {
        "absorb": "absorb:Absorb",
        "cercignani-lampis": "cercignani_lampis:CercignaniLampis",
        "lambert": "lambert:Lambert",
        "sticky": "sticky:Sticky",
    },
)


def __getattr__(name: str) -> Any:
    return ALL_LAWS.named(name)
