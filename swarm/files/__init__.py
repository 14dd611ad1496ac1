"""Files of runs: trajectories, logs of impacts, checkpoints, and the means that keep them complete."""
