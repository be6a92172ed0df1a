from .drawing_files import LAYER_COLOURS as LAYER_COLOURS
from .package_folder import PackageFolder as PackageFolder
