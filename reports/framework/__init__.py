"""Figure 1 of the paper: the framework, drawn from the geometry of a study."""
