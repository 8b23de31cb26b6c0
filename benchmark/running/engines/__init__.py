"""Where the jobs of a run are executed: on this machine, or on a cluster."""
