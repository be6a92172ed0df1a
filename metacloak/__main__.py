"""Runs a stage: `metacloak STAGE ...`, or `python -m metacloak STAGE ...`."""

import sys

from metacloak.pipeline.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
