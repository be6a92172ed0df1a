"""The page on what was tried to lose or to spoil results, and what survived."""
