from . import content as content
from . import facts as facts
from . import figure as figure
from . import tables as tables
