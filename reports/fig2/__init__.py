"""Figure 2 of the paper: shielding dynamic excitations."""
