"""The stages: each module reads datasets, calls `sim`, and writes a dataset."""

from pipeline.runtime import pin

pin()
