"""Whether a run went well: a sentence with its figure for each thing that should hold."""

from typing import Any, NamedTuple


class Verdict(NamedTuple):
    """What should hold, as "energy", whether it does (None: nothing to judge), and how well, in words."""

    about: str
    holds: bool | None
    text: str


def judged(content: Any) -> list[Verdict]:
    """The verdicts on a run, of what plots show of it (`plots.Content`)."""
    worst = float(content.seen["energy_error"].max())
    return [Verdict("energy", worst < 1e-12, f"the worst particle's relative error is {worst:.1e}")]
