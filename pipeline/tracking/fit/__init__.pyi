from .frame_fit import PoseFitter as PoseFitter
from .patch_correlation import PoseFits as PoseFits
from .patch_correlation import Templates as Templates
from .side_walls import SideWalls as SideWalls
from .template import TemplateGrid as TemplateGrid
from .template import learn_templates as learn_templates
from .template import outline_templates as outline_templates
from .template import pixel_plane as pixel_plane
