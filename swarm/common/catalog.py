"""The observables of runs: the unit, axes and meaning of each, for files, tables, pictures and the guide."""

from typing import Any, Literal, NamedTuple

from .checks import closest

# The lengths of axes that are the same in every run; the other axes have one entry for each surface, part and so on.
LENGTHS = {"sense": 2, "axis": 3, "quaternion": 4}
# The names of the entries along the last axis of a vector, and of an orientation.
_COMPONENTS = {"axis": ("x", "y", "z"), "quaternion": ("w", "x", "y", "z")}

# The quantities by which particles of pictures and recordings are coloured.
COLOURINGS = ("speed", "energy-error")

Axis = Literal["surface", "part", "member", "cavity", "source", "counter", "sense", "axis", "quaternion"]


class Observable(NamedTuple):
    """The description of an observable in every run that has it.

    Attributes:
        unit: in SI units, as xarray and pint read it; "1" for numbers.
        meaning: its meaning in words.
        axes: its axes besides the time.
        joined: how the value of a run in shards follows from the shards: their "sum", the "largest", or the "same".
        every: whether files of every version have it.
        main: whether a sweep shows it.
        may_be_nan: whether NaN is one of its values.
        instead: the advice for a run without it, for the message of an error.
    """

    unit: str
    meaning: str
    axes: tuple[Axis, ...] = ()
    joined: Literal["sum", "largest", "same"] = "sum"
    every: bool = False
    main: bool = False
    may_be_nan: bool = False
    instead: str = ""

    def components(self) -> tuple[str, ...] | None:
        """Return the names of the entries of its last axis; None if they have numbers.

        >>> OBSERVABLES["momentum"].components(), OBSERVABLES["impulse"].components()
        (('x', 'y', 'z'), None)
        """
        return _COMPONENTS.get(self.axes[-1]) if self.axes else None

    def shape(self, lengths: dict[str, int]) -> tuple[int | None, ...]:
        """Return the shape of an entry, with the `lengths` of axes such as "surface"; None: any length."""
        return tuple((LENGTHS | lengths).get(axis) for axis in self.axes)

    def axes_in_words(self) -> list[str]:
        """Return the lengths of its axes, in words if they differ between runs."""
        plural = {axis: f"{axis[:-1]}ies" if axis.endswith("y") else f"{axis}s" for axis in self.axes}
        return ["frames", *(str(LENGTHS.get(axis, plural[axis])) for axis in self.axes)]


# In the order in which a sweep shows them: first those of openings, absorbing walls and counters.
OBSERVABLES: dict[str, Observable] = {
    "time": Observable("s", "time of the frame", joined="same"),
    "escaped": Observable("1", "particles that left through openings", every=True, main=True),
    "absorbed": Observable("1", "particles that a law of the surface has absorbed", ("surface",), main=True),
    "crossings": Observable("1", "particles that crossed the counter: out, back", ("counter", "sense"), main=True),
    "kinetic_energy": Observable("J", "kinetic energy, of rotation too for bodies", every=True, main=True),
    "total_energy": Observable(
        "J", "kinetic, potential and contact energy, of spins and of walls with a mass too", every=True, main=True
    ),
    "dissipated_energy": Observable("J", "energy lost at contacts since the start", every=True, main=True),
    "pressure": Observable(
        "Pa", "pressure of balls by the virial since the frame before; N/m in a plane; NaN where no volume is known",
        main=True, may_be_nan=True,
        instead="of points it is the impulse on surface i, observables['impulse'][:, i], over its area and the time",
    ),
    "impacts": Observable("1", "impacts on surfaces since the start", every=True, main=True),
    "collisions": Observable("1", "pairs of balls that met since the start", main=True),
    "born": Observable("1", "particles that the source has released", ("source",), main=True),
    "blocked": Observable("1", "births of balls that found no free place at their time", ("source",), main=True),
    "wall_heat": Observable("J", "heat from the surface since the start", ("surface",), main=True),
    "wall_work": Observable("J", "work of the surface that moves, since the start", ("surface",), main=True),
    "work": Observable("J", "work of anchors of bodies that are led", main=True),
    "source_energy": Observable("J", "energy of the particles that sources released", main=True),
    "potential_energy": Observable("J", "energy in gravity", every=True, main=True),
    "sliding": Observable("1", "particles that slide or rest on a wall", main=True),
    "impulse": Observable("N s", "normal impulse on the surface since the start", ("surface",), every=True, main=True),
    "energy_error": Observable(
        "1", "largest relative error of the energy balance of a particle", joined="largest", every=True, main=True
    ),
    "max_penetration": Observable(
        "m", "largest distance of a particle beyond a wall", joined="largest", every=True, main=True
    ),
    "largest_overlap": Observable(
        "m", "largest overlap of soft balls since the frame before", joined="largest", main=True
    ),
    "contact_energy": Observable("J", "energy stored in contacts and springs", every=True),
    "rotational_energy": Observable("J", "energy of the spins of balls"),
    "momentum": Observable("kg m s-1", "momentum of all particles", ("axis",)),
    "angular_momentum": Observable("kg m2 s-1", "angular momentum about the origin, spins included", ("axis",)),
    "collision_rate": Observable("s-1", "pairs of balls that met in a second since the frame before", may_be_nan=True),
    "sliding_time": Observable("s", "time for which particles slid or rested, of all, since the start"),
    "unconverged": Observable("1", "steps in which multipliers, or friction of grains, did not converge", every=True),
    "sweeps": Observable("1", "sweeps of the loops of multipliers since the start"),
    "link_error": Observable("1", "largest relative error of the length of a link", joined="largest"),
    "part_impulse": Observable("N s", "normal impulse on the part of a union since the start", ("part",)),
    "part_heat": Observable("J", "heat from the part of a union since the start", ("part",)),
    "cavity_impulse": Observable("N s", "normal impulse on the cavity of a body since the start", ("cavity",)),
    "member_impacts": Observable("1", "impacts on the member of a field since the start", ("member",)),
    "member_residence": Observable("s", "time for which particles slid, rested or waited on the member", ("member",)),
    "member_heat": Observable("J", "heat from the member since the start", ("member",)),
    "member_absorbed": Observable("1", "particles that a law of the member has absorbed", ("member",)),
    "crossed_momentum": Observable(
        "kg m s-1", "momentum of the particles that crossed the counter: out, back", ("counter", "sense", "axis")
    ),
    "crossed_energy": Observable(
        "J", "kinetic energy of the particles that crossed the counter: out, back", ("counter", "sense")
    ),
    "crossed_slowness": Observable("s m-1", "sum of 1/|v_n| at the counter: out, back", ("counter", "sense")),
    "wall_energy": Observable("J", "energy of the wall with a mass", ("surface",)),
    "wall_position": Observable("m", "displacement of the surface that moves", ("surface", "axis"), joined="same"),
    "wall_orientation": Observable(
        "1", "orientation of the surface that moves, (w, x, y, z)", ("surface", "quaternion"), joined="same"
    ),
    "wall_velocity": Observable("m s-1", "velocity of the wall with a mass", ("surface", "axis")),
    "wall_spin": Observable("rad s-1", "angular velocity of the wall with a mass", ("surface", "axis")),
}  # fmt: skip

# The sums over chunks of particles of a shard, from which the observables of all shards are joined.
CHUNK_SUMS = "chunk_sums"
NAMES = frozenset((*OBSERVABLES, CHUNK_SUMS))
MAIN = tuple(name for name, one in OBSERVABLES.items() if one.main)
# The errors that every run has: 0, or round-off, if all went well.
ERRORS = tuple(name for name, one in OBSERVABLES.items() if one.every and one.joined == "largest")


def may_be_nan(name: str) -> bool:
    """Whether NaN is one of the values of an observable."""
    return name in OBSERVABLES and OBSERVABLES[name].may_be_nan


class Observables(dict[str, Any]):
    """The observables of a run by their names; an unknown name is a `KeyError` that lists them.

    >>> Observables(impacts=3)["impact"]
    Traceback (most recent call last):
    KeyError: "this run has no observable 'impact'; did you mean 'impacts'? It has impacts"
    """

    def __missing__(self, name: Any) -> Any:
        known = OBSERVABLES.get(name)
        hint = closest(name, self) or "."
        if known:
            hint = f", {known.meaning}{known.instead and '; '}{known.instead}."
        raise KeyError(f"this run has no observable {name!r}{hint} It has {', '.join(self)}")


def markdown() -> list[str]:
    """Return the table of the guide, in lines of Markdown.

    >>> markdown()[2]
    '| `time` | s | frames | time of the frame |'
    """
    rows: list[Any] = [("observable", "unit", "shape", "meaning"), ("---",) * 4]
    for name, one in OBSERVABLES.items():
        rows.append(
            (
                f"`{name}`",
                "" if one.unit == "1" else one.unit,
                ", ".join(one.axes_in_words()),
                one.meaning.replace("|", r"\|"),
            )
        )
    return [f"| {' | '.join(row)} |" for row in rows]
