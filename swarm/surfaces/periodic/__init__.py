"""A periodic cell, and the images of its walls."""
