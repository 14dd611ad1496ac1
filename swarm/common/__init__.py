"""What all parts of the package share: checks, frames, tables of names."""
