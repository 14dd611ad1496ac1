"""Laws of walls: each is a `WallLaw` as one's own is."""

from .absorb import Absorb
from .cercignani_lampis import CercignaniLampis
from .lambert import Lambert
from .sticky import Sticky

__all__ = ["Absorb", "CercignaniLampis", "Lambert", "Sticky"]
