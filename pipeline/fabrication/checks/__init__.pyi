from .package_check import STEPS as STEPS
from .package_check import check_package as check_package
