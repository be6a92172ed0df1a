from .designs import NETWORK as NETWORK
from .load_cycles import ROLES as ROLES
from .schemas import SCHEMA_VERSION as SCHEMA_VERSION
from .schemas import SCHEMAS as SCHEMAS
from .schemas import TABLES as TABLES
from .schemas import Kind as Kind
from .variables import Table as Table
from .variables import Variable as Variable
