"""Pictures of runs: plots, films, and the style of both."""
