"""Sources: particles that come during a run, with the places, times and velocities of their births."""
