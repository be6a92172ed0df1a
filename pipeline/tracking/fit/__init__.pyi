from .frame_fit import Fitter as Fitter
from .patch_correlation import Fits as Fits
from .patch_correlation import Templates as Templates
from .side_walls import Walls as Walls
from .template import Learner as Learner
from .template import TemplateGrid as TemplateGrid
from .template import outlines as outlines
from .template import plane_of as plane_of
