"""Errors. Each message says what was expected, what was given, where, and how to fix it."""


class SwarmError(Exception):
    """The base of every error that swarm raises on purpose."""


class SceneError(SwarmError, ValueError):
    """Bad input: an argument, a TOML key, or a row of a file, found before anything runs or is written.

    Attributes:
        particle: the number of the first particle with the error; None if the error is not about particles.
    """

    particle: int | None = None


class CompleteError(SceneError):
    """A run that cannot be resumed because it is complete."""


class FileError(SwarmError, OSError):
    """A file that cannot be read or written, or must not be overwritten."""


class WallTimeError(SwarmError):
    """A run that stopped at its wall time limit. A run with checkpoints can be resumed.

    Attributes:
        compiled: the time after the limit at which a compilation under way ended [s].
    """

    def __init__(self, message: str, compiled: float = 0.0) -> None:
        late = f": a compilation was under way, which ended first, {compiled:.2g} s after it" if compiled else ""
        super().__init__(message + late)
        self.compiled = compiled


class RunError(SwarmError, RuntimeError):
    """A run that failed; every finished frame is kept."""
