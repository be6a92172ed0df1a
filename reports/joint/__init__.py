"""Report of several studies on one page."""
