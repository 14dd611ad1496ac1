"""Where methods fail, as maps: `python -m bench stability`."""

from ..report import machine
from . import grazing, roundoff, stiffness, tunnelling, uzawa

MAPS = {
    "stiffness": stiffness,
    "uzawa": uzawa,
    "tunnelling": tunnelling,
    "grazing": grazing,
    "roundoff": roundoff,
}


def main(quick: bool) -> None:
    """Measure every map; unless quick, write a CSV and a PNG of each."""
    print(machine())
    for name, one in MAPS.items():
        cells = one.measure(quick)
        print("\n".join(f"{name}: {sentence}" for sentence in one.told(cells)), flush=True)
        if not quick:
            one.draw(cells)
