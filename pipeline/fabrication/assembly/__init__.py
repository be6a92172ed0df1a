"""The assembly sheet: a PDF at true scale that says which part goes where, and in which order."""

from pipeline.fabrication.assembly.document import write

__all__ = ["write"]
