from .catalogue import VIDEOS as VIDEOS
from .catalogue import suites as suites
