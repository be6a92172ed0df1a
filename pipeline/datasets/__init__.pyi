from . import chunked as chunked
from . import provenance as provenance
from .files import read as read
from .files import read_attributes as read_attributes
from .files import write as write
from .provenance import file_hash as file_hash
from .provenance import git_commit as git_commit
from .provenance import package_versions as package_versions
