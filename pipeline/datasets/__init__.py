"""The datasets between the stages: their schemas, and the only way to write and read them."""

from pipeline.datasets.files import SchemaError, read, write
from pipeline.datasets.tables import SCHEMA_VERSION, TABLES, Kind
from pipeline.datasets.variables import Variable

__all__ = [
    "SCHEMA_VERSION",
    "TABLES",
    "Kind",
    "SchemaError",
    "Variable",
    "read",
    "write",
]
