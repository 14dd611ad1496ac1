"""Places for balls among others and within walls."""
