"""The version, where packaging and files read it without importing the engine."""

VERSION = "0.1.0"
