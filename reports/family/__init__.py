"""Report of several designs of one problem on one page."""
