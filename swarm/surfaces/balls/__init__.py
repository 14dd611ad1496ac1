"""What the centres of balls meet where that is of another kind than the wall: edges are round, tips are elsewhere."""
