"""Where and when a wall is present: openings, doors, rooms and patches."""
