"""A sweep over any parameters: figure, tables and page."""
