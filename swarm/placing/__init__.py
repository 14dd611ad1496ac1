"""Random places for balls among others and within walls."""
