"""Many walls of one kind: arrays of their numbers, and a grid of cells that finds the near ones."""
