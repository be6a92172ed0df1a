from . import catalogue as catalogue
