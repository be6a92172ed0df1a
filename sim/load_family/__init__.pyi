from .exchange import FamilyOptions as FamilyOptions
from .exchange import minimise_worst as minimise_worst
from .family_losses import LoadFamily as LoadFamily
from .family_losses import LoadLosses as LoadLosses
from .worst_load import FoundLoad as FoundLoad
from .worst_load import SearchOptions as SearchOptions
from .worst_load import ascend as ascend
from .worst_load import spread_places as spread_places
