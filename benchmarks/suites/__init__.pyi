from . import static as static
from . import warm as warm
