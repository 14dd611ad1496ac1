"""The ranges of the numbers of laws."""

from typing import Any

from ...errors import SceneError


def require_probability(name: str, value: Any) -> None:
    """Raise a `SceneError` if a number is no probability."""
    require_part(name, value, 1.0)


def require_part(name: str, value: Any, most: float) -> None:
    """Raise a `SceneError` if a number is below 0 or above `most`, or missing."""
    if value is None or not 0.0 <= value <= most:
        raise SceneError(f"{name} must be from 0 to {most:g}, got {'none' if value is None else f'{value:g}'}")


def require_magnitude(name: str, value: Any, unit: str) -> None:
    """Raise a `SceneError` if a number is below 0, or missing."""
    if value is None or not value >= 0.0:
        raise SceneError(f"{name} must be 0 {unit} or more, got {'none' if value is None else f'{value:g}'}")
