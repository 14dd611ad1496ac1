"""`swarm new`: a scene file to begin with."""

from pathlib import Path
from typing import Annotated

from .options import Option, Positional


def new(
    kind: Annotated[str, Positional(metavar="KIND", help="cavity, hopper, billiard, gas or mechanism.")],
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="SCENE.toml", help="File [default: KIND.toml, here].")
    ] = None,
) -> None:
    """Write a scene file with comments to begin with."""
    from ..authoring.starters import begin

    print(f"written to {(path := begin(kind, output))}; next:  swarm run {path}")
