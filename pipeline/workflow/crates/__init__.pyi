from .files_named import SCHEMA as SCHEMA
from .files_named import named_outside as named_outside
from .metadata import BUILT as BUILT
from .metadata import describe as describe
from .publication import Publication as Publication
from .results_held import leftovers as leftovers
