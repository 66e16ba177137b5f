"""Von Mises' law with linear isotropic hardening, vectorised over points."""

import typing

import numpy as np

ONE = np.array([1.0, 1, 1, 0, 0, 0])
DEVIATOR = np.diag([1, 1, 1, 0.5, 0.5, 0.5]) - np.outer(ONE, ONE) / 3
"""From engineering strain (xx yy zz xy yz xz) to the deviator as a tensor."""


class Response(typing.NamedTuple):
    stress: np.ndarray
    dense: np.ndarray
    """Energy per volume."""
    plastic: np.ndarray
    """Numbers of the points that yield."""
    norm: np.ndarray
    """Of these: that of the trial stress' deviator, and its direction."""
    direction: np.ndarray


class Material:
    def __init__(self, young, poisson, yield_stress, hardening):
        self.shear, self.bulk = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))
        self.radius = np.sqrt(2 / 3) * yield_stress
        self.beta = 2 * self.shear / (2 * self.shear + 2 * hardening / 3)
        self.elastic = self.bulk * np.outer(ONE, ONE) + 2 * self.shear * DEVIATOR

    def respond(self, strain):
        stress = strain @ (2 * self.shear * DEVIATOR)
        square = stress * stress
        norm = np.sqrt(square[:, :3].sum(1) + 2 * square[:, 3:].sum(1))
        plastic = np.flatnonzero(norm > self.radius)
        beyond = norm[plastic] - self.radius
        direction = stress[plastic] / norm[plastic][:, None]
        stress[plastic] -= self.beta * beyond[:, None] * direction
        trace = strain[:, :3].sum(1)
        stress[:, :3] += self.bulk * trace[:, None]
        dense = norm**2 / (4 * self.shear) + self.bulk / 2 * trace**2
        dense[plastic] -= self.beta * beyond**2 / (4 * self.shear)
        return Response(stress, dense, plastic, norm[plastic], direction)

    def softening(self, response, part):
        """Consistent tangent less the elastic one, of a slice of the points that yield."""
        ratio = (self.radius / response.norm[part])[:, None, None]
        normal = response.direction[part]
        return -2 * self.shear * self.beta * ((1 - ratio) * DEVIATOR + ratio * normal[:, :, None] * normal[:, None, :])
