from .drawing_files import COLOURS as COLOURS
from .package_folder import PackageFolder as PackageFolder
