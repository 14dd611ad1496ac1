"""Laws of walls: each is a `WallLaw`, as a user-defined law is."""

from typing import Any

from .absorb import Absorb
from .cercignani_lampis import CercignaniLampis
from .lambert import Lambert
from .sticky import Sticky

__all__ = ["ALL_LAWS", "Absorb", "CercignaniLampis", "Lambert", "Sticky"]

# Name in scene files -> class.
ALL_LAWS: dict[str, Any] = {
    "absorb": Absorb,
    "cercignani-lampis": CercignaniLampis,
    "lambert": Lambert,
    "sticky": Sticky,
}
