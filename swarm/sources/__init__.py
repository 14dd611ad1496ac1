"""Sources: particles that come during a run, where they are born, when, and with which velocity."""
