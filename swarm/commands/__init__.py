"""The commands, one function each. No physics, and no heavy import before it is needed: --help must be fast."""
