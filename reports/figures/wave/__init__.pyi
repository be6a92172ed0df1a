from . import facts as facts
from . import figure as figure
