"""A recording beside the simulation of what it shows: common frame and axis, metrics, verdicts."""
