"""Common parts of the package: checks, frames, tables of names."""
