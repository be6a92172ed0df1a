"""Shows the losses of a design over a family of loads: figure, facts, claims, page."""
