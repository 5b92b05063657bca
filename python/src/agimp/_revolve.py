"""Bodies of revolution in space: copies of the particles of the half plane, next to each other about the axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

SPANS = {"open": 1.5 * np.pi, "whole": 2.0 * np.pi}
"""How far bodies are turned: `open` leaves out the quarter where x > 0 and y < 0, as the program does."""


class Copies:
    """Copies of particles with these radii and half widths of their sections, m: of each as many as fit about the axis."""

    def __init__(self, radii: NDArray[np.float64], halves: NDArray[np.float64], span: float) -> None:
        counts = np.maximum(np.ceil(span * np.maximum(radii, 0.0) / (2.0 * halves)), 1.0).astype(np.int64)
        self.of = np.repeat(np.arange(len(radii)), counts)
        """Number of the particle of each copy."""
        number = np.arange(len(self.of)) - np.repeat(np.cumsum(counts) - counts, counts)
        angles = span * (number + 0.5) / counts[self.of]
        self._cosine, self._sine = np.cos(angles), np.sin(angles)

    def places(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places in space of particles at these radii and heights, m; z is the axis."""
        radius, height = positions[self.of, 0], positions[self.of, 1]
        return np.column_stack([radius * self._cosine, radius * self._sine, height])

    def values(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the copies: vectors (radius, axis, hoop) and tensors (xx, yy, zz, xy, yz, xz) turn with them."""
        own, c, s = values[self.of], self._cosine, self._sine
        if own.ndim == 2 and own.shape[1] == 3:
            radial, axial, hoop = own.T
            return np.column_stack([radial * c - hoop * s, radial * s + hoop * c, axial])
        if own.ndim == 2 and own.shape[1] == 6:
            radial, axial, hoop, shear = own.T[:4]
            across = (radial - hoop) * s * c
            return np.column_stack(
                [radial * c * c + hoop * s * s, radial * s * s + hoop * c * c, axial, across, shear * s, shear * c]
            )
        return own
