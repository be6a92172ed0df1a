from . import kinds as kinds
