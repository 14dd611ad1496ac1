"""Jobs in other processes, of this machine or of a cluster: the runs of a sweep, and the shards of a run."""
