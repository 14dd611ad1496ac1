"""Where and when a wall is there: openings, doors, rooms and patches."""
