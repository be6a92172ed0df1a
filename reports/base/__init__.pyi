from . import style as style
from .csv_table import Table as Table
from .page_prose import prose as prose
from .style import ALTERED as ALTERED
from .style import GREY as GREY
from .style import INTACT as INTACT
from .style import MM_PER_INCH as MM_PER_INCH
from .style import PALE as PALE
