"""Models the Lagrangian's Hessian by damped BFGS (Powell 1978; Nocedal and Wright, sec. 18.3)."""

import numpy as np

from sim.core import Floats

DAMPING = 0.2
"""Smallest curvature along a step, relative to the model's, that an update may leave."""

EASE = 0.3
"""Curvature of directions not yet seen, relative to the first one measured.

The losses at hand are sums of squares that few directions bend; the trust radius bounds the others.
"""


class QuasiNewton:
    """Approximates a Hessian by a positive definite matrix, learned from gradient differences."""

    def __init__(self, size: int, curvature: float) -> None:
        self.matrix: Floats = np.eye(size) * curvature  # a multiple of 1 until the first update
        self._learned = False

    def reduction(self, gradient: Floats, step: Floats) -> float:
        """Predicts the decrease of the loss along a step."""
        # -(g.d + d.B d / 2)
        return -float(gradient @ step + step @ self.matrix @ step / 2)

    def update(self, step: Floats, change: Floats) -> None:
        """Learns that the gradient of the Lagrangian changes by ``change`` along ``step``."""
        if not step.any():
            return
        along = float(step @ change)
        if not self._learned and along > 0:
            self.matrix = np.eye(len(step)) * (EASE * along / float(step @ step))
            self._learned = True
        image = self.matrix @ step
        model = float(step @ image)
        if along < DAMPING * model:
            blend = (1 - DAMPING) * model / (model - along)
            change = blend * change + (1 - blend) * image
            along = DAMPING * model
        # B += y y' / y.d - B d (B d)' / d.B d
        self.matrix += np.outer(change, change) / along - np.outer(image, image) / model
