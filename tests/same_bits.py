"""What it means that two runs, or a run and its files, have the same bits."""

_OF_PARTICLES = ("position", "velocity", "mass", "radius", "spin", "image")
_OF_RESULTS = ("impacts_per_particle", "collisions_per_particle", "escape_time", "absorbed_time", "birth_time")


def require_same_observables(one, other):
    """Of results or trajectories: the same names, and under each the same bits of the same type."""
    mine, its = one.observables, other.observables
    assert mine.keys() == its.keys()
    for name in mine:
        _require_same_array(name, mine[name], its[name])


def require_same(one, other):
    """Of results: the observables, the particles at the end, what is known of each, and the multipliers."""
    require_same_observables(one, other)
    for name in _OF_PARTICLES:
        _require_same_array(name, getattr(one.particles, name), getattr(other.particles, name))
    for name in _OF_RESULTS:
        _require_same_array(name, getattr(one, name), getattr(other, name))
    for mine, its in zip(one.multipliers or (), other.multipliers or (), strict=True):
        _require_same_array("multipliers", mine, its)


def _require_same_array(name, one, other):
    assert (one is None) == (other is None), name
    if one is not None:
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes()), name
