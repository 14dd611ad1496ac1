"""The version, in a module that packaging and files can import without the engine."""

VERSION = "0.1.0"
