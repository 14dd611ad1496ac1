"""Bodies: several points tied together. Their description, their construction, and their start."""
