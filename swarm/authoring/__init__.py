"""From a scene file: its run in Python, what it will do, its schema, files to begin with, and the reference."""
