from .package_folder import PackageFolder as PackageFolder
