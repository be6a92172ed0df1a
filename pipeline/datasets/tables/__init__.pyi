from .schemas import NETWORK as NETWORK
from .schemas import SCHEMA_VERSION as SCHEMA_VERSION
from .schemas import SCHEMAS as SCHEMAS
from .schemas import TABLES as TABLES
from .schemas import Kind as Kind
from .schemas import Table as Table
from .schemas import Variable as Variable
