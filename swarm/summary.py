"""How a run went, in numbers for other programs."""

from pathlib import Path
from typing import Any

from .observables import drift


def numbers(trajectory: Path) -> dict[str, Any]:
    """A run's summary from its trajectory, which holds a frame: what JSON can hold."""
    from .output.trajectory import load

    with load(trajectory) as written:
        seen, particles = written.observables, written.count
    return {
        "trajectory": str(trajectory),
        "particles": particles,
        "frames": len(seen["time"]),
        "time": float(seen["time"][-1]),
        "impacts": int(seen["impacts"][-1]),
        "energy_drift": drift(seen),
        "energy_error": float(seen["energy_error"].max()),
        "max_penetration": float(seen["max_penetration"].max()),
        "dissipated_energy": float(seen["dissipated_energy"][-1]),
        "escaped": int(seen["escaped"][-1]),
        "unconverged": int(seen["unconverged"][-1]),
    }
