"""What goes wrong, as sentences: what was expected, what came, where, and how to mend it."""


class SwarmError(Exception):
    """Base of every error that swarm raises on purpose."""


class SceneError(SwarmError, ValueError):
    """Bad input: an argument, a TOML key, a row of a file. Found before anything runs or is written."""


class FileError(SwarmError, OSError):
    """A file that cannot be read or written, or must not be overwritten."""


class RunError(SwarmError, RuntimeError):
    """A run that could not go on; every finished frame is kept."""
