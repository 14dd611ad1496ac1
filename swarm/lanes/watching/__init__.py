"""What is counted and logged of particles in lanes."""
