"""Figures, tables and pages built from the datasets of a study."""
