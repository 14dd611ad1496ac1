"""Files of runs: trajectories, logs of impacts, checkpoints, and what keeps them whole."""
