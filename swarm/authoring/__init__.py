"""From a scene file: its run in Python, its outlook, its schema, files to begin with, and the reference."""
