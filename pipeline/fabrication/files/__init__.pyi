from . import package_folder as package_folder
