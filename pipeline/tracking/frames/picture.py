"""Reads single pictures."""

from pathlib import Path

import cv2
import numpy as np

from pipeline.runtime import UserError
from sim.core import Image


def read_picture(path: Path) -> Image:
    """Reads a picture as grey levels (rows, columns).

    Raises:
        UserError: there is none.
    """
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        remedy = "name a PNG, TIFF or JPEG that is there"
        raise UserError("no picture that can be read", file=path, remedy=remedy)
    return np.asarray(image, np.uint8)
