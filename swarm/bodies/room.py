"""The largest size of a body: its full matrices grow with the square of its number of points."""

from ..common import checks
from ..errors import SceneError

# The most bytes of the matrices of a body: a chain of 3200 points. More would take minutes before the first step.
_MOST = 1_000_000_000
# The part of a machine's memory that a body may take: a run has copies of some of the matrices.
_SHARE = 0.25
_NUMBER = 8


def require(points: int, ties: int = 0, contacts: int = 0, edges: int = 0) -> None:
    """Raise a `SceneError` if the matrices of a body would not fit, before any of them is made.

    With P points, T ties (links, springs, edges of a strain, guides and cavities), K contact points and E edges of a
    strain, these are: masses and their inverse (P, P), contact points and their responses (K, P), the couplings of ties
    and contact points (T + K, T + K), the system of ties (T, T), and stiffness and compliance (E, E).
    """
    # Numbers that float() can convert.
    p, t, k, e = (min(count, 10**100) for count in (points, ties, contacts, edges))
    size = _NUMBER * (2 * p * p + 2 * k * p + (t + k) ** 2 + t * t + 2 * e * e)
    most = min(_MOST, _SHARE * checks.memory())
    if size > most:
        held = {"points": p, "ties": t, "contact points": k}
        parts = ", ".join(f"{count:.6g} {name}" for name, count in held.items() if count)
        raise SceneError(
            f"a body must fit in {checks.in_bytes(most)}, got {parts}: the matrices of masses, ties and contacts are "
            f"full and take {checks.in_bytes(size)}; use fewer points, or several bodies"
        )
