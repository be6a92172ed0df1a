"""Shows a sweep over any parameters: figure, tables, page."""
