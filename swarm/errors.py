"""What goes wrong, as sentences: what was expected, what came, where, and how to mend it."""


class SwarmError(Exception):
    """Base of every error that swarm raises on purpose."""


class SceneError(SwarmError, ValueError):
    """Bad input: an argument, a TOML key, a row of a file. Found before anything runs or is written."""


class CompleteError(SceneError):
    """A run that cannot be resumed because nothing of it is left to do."""


class FileError(SwarmError, OSError):
    """A file that cannot be read or written, or must not be overwritten."""


class WallTimeError(SwarmError):
    """A run that stopped at its limit of wall time, with a checkpoint if it makes any; resume goes on with it."""


class RunError(SwarmError, RuntimeError):
    """A run that could not go on; every finished frame is kept."""
