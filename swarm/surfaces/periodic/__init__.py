"""A cell that repeats, and the images of its walls."""
