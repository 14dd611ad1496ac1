"""Bodies: several points tied together. What they are, how they are made, and where they start."""
