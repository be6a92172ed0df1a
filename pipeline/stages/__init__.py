"""Runs the stages: one module a rule, of the same name; each reads and writes datasets."""
