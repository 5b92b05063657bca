"""Units and descriptions of the data sets, and names for their components."""

from __future__ import annotations

from typing import NamedTuple


class Field(NamedTuple):
    """What a data set holds."""

    unit: str
    """SI unit, empty for pure numbers."""
    description: str


KNOWN: dict[str, Field] = {
    "position": Field("m", "position"),
    "velocity": Field("m/s", "velocity"),
    "speed": Field("m/s", "magnitude of the velocity"),
    "id": Field("", "identifier of the particle"),
    "material": Field("", "material"),
    "body": Field("", "body"),
    "strain": Field("", "total logarithmic strain since the particle came"),
    "equivalent_strain": Field("", "equivalent total strain"),
    "displacement": Field("m", "displacement since the particle came"),
    "particle_level": Field("", "tree level that the particle was made for"),
    "leaf_level": Field("", "level of the leaf that holds the particle"),
    "plastic_strain": Field("", "first history variable of the material, as a rule the accumulated plastic strain"),
    "damage": Field("", "stiffness that cracks have taken; of metals plastic strain over failure strain"),
    "pressure": Field("Pa", "mean Cauchy stress with the sign changed; positive in compression"),
    "von_mises": Field("Pa", "von Mises equivalent of the Cauchy stress"),
    "stress": Field("Pa", "Cauchy stress"),
    "mass": Field("kg", "mass; per metre of thickness in plane strain"),
    "density": Field("kg/m³", "density"),
    "volume_ratio": Field("", "volume over reference volume, det F"),
    "pore_pressure": Field("Pa", "pressure of the water in the pores"),
    "head": Field("m", "head of the water in the pores"),
    "total_pressure": Field("Pa", "pressure of ground and water together"),
    "total_stress": Field("Pa", "stress of ground and water together"),
    "excess_pore_pressure": Field("Pa", "excess pore pressure of undrained material"),
    "effective_pressure": Field("Pa", "pressure less the excess pore pressure"),
    "effective_stress": Field("Pa", "Cauchy stress without the excess pore pressure"),
    "contact_pressure": Field("Pa", "pressure of contact with other bodies"),
    "half_width": Field("m", "half of the undeformed edge of the particle's box"),
    "plastic_work": Field("J/m³", "plastic work done so far, per reference volume"),
    "level": Field("", "level of the leaf"),
    "particles": Field("", "particles in the leaf"),
    "edge": Field("m", "edge of the leaf"),
}
"""Fields of files that do not describe themselves. Descriptions in a file come first."""

AXES = ("x", "y", "z")
SYMMETRIC = ("xx", "yy", "zz", "xy", "yz", "xz")
"""Components of a symmetric tensor in the order of VTK."""


def components(name: str, count: int) -> tuple[str, ...]:
    """Names for the columns of a field with `count` components: `velocity_x`, `stress_xy`."""
    if count in (2, 3):
        return tuple(f"{name}_{axis}" for axis in AXES[:count])
    if count == len(SYMMETRIC):
        return tuple(f"{name}_{pair}" for pair in SYMMETRIC)
    return tuple(f"{name}_{number}" for number in range(count))
