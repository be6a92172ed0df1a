"""Describes a specimen's constants: units, ligaments, damping, contact."""

from collections.abc import Mapping
from typing import Literal, Self

from pydantic import Field, ValidationInfo, model_validator
from pydantic.json_schema import SkipJsonSchema

from pipeline.problem.fields import (
    SIM_UNITS,
    Angle,
    BendingStiffness,
    ContactStiffness,
    Damping,
    Density,
    Length,
    Modulus,
    Ratio,
    RotaryDamping,
    Section,
    Stiffness,
    fault,
)
from sim.structure import Foil, damping_of_ratio


class DampingLaw(Section):
    """Viscous damping to ground per unit: the authors' ratio, or the two coefficients.

    Attributes:
        ratio: over the critical damping of one unit on one ligament.
        translation: force over velocity; together with `rotation`.
        rotation: torque over angular velocity.
    """

    ratio: Ratio | None = None
    translation: Damping | None = None
    rotation: RotaryDamping | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        pair = [self.translation is not None, self.rotation is not None]
        if (self.ratio is not None) == any(pair) or any(pair) != all(pair):
            raise fault("one form of damping is wanted", "give ratio, or translation and rotation")
        return self


class FoilStrip(Section):
    """Foil that the ligaments are strips of, held by rigid ends.

    Attributes:
        young_modulus: along the strips.
        thickness: of the foil.
        width: of the strips, across the plane: the height of the units.
    """

    young_modulus: Modulus
    thickness: Length
    width: Length

    @property
    def foil(self) -> Foil:
        """Returns the foil as sim/ knows it."""
        return Foil(self.young_modulus, self.thickness, self.width)


STIFFNESSES = ("axial_stiffness", "shear_stiffness", "bending_stiffness")


class MaterialConstants(Section):
    """Units and ligaments.

    Attributes:
        density: mass of the units over their area, in the plane.
        axial_stiffness: force over elongation of a ligament; all three, or `foil`.
        shear_stiffness: force over lateral displacement of its ends.
        bending_stiffness: torque over relative rotation of its ends.
        foil: what ligaments are made of, in place of the three stiffnesses.
        damping: of the units.
    """

    density: Density
    axial_stiffness: Stiffness = Field(default_factory=float)
    shear_stiffness: Stiffness = Field(default_factory=float)
    bending_stiffness: BendingStiffness = Field(default_factory=float)
    foil: FoilStrip | None = None
    damping: DampingLaw

    @model_validator(mode="after")
    def _one_form_of_stiffness(self, info: ValidationInfo) -> Self:
        given = [name for name in STIFFNESSES if name in self.model_fields_set]
        missing = [name for name in STIFFNESSES if name not in given]
        if self.foil is None and missing:
            raise fault("missing key", "add it, or foil in the place of all three", missing[0])
        if self.foil is not None and given and info.context != SIM_UNITS:
            raise fault(f"foil and {given[0]} exclude each other", "leave one of them out")
        return self

    def damping_coefficients(self, spacing: float) -> tuple[float, float]:
        """Computes translational (tonne/s) and rotary (tonne mm^2/s) damping of every unit.

        The ratio is that of a single-ligament oscillator with the mass and inertia of a square
        that is not rotated, whatever the design (the authors' formula).
        """
        law = self.damping
        if law.ratio is None:
            assert law.translation is not None
            assert law.rotation is not None
            return law.translation, law.rotation
        stiffness = (self.shear_stiffness, self.bending_stiffness)
        return damping_of_ratio(law.ratio, self.density, spacing, *stiffness)


class NumericConstants(MaterialConstants):
    """Units and ligaments, told by numbers alone: those of foil follow from a lattice's lengths.

    Attributes:
        axial_stiffness: force over elongation of a ligament.
    """

    axial_stiffness: Stiffness
    shear_stiffness: Stiffness
    bending_stiffness: BendingStiffness
    foil: SkipJsonSchema[FoilStrip | None] = None

    @model_validator(mode="before")
    @classmethod
    def _refuse_foil(cls, data: object) -> object:
        if isinstance(data, Mapping) and data.get("foil") is not None:
            remedy = f"give {', '.join(STIFFNESSES)} of one ligament in its place"
            raise fault("foil is for problems alone: no length is told here", remedy, "foil")
        return data


class Contact(Section):
    """Contact of units: on the void angles of bonded ones (the authors'), or on true distances.

    On angles there is none above the cut-off and no bound at the barrier; on distances none beyond
    `distance` and no bound at a touch. Designs are judged by both.

    Attributes:
        law: by which the design is optimised.
        stiffness: of the contact, torque over angle squared.
        barrier_angle: void angle at which the energy is infinite.
        cutoff_angle: void angle above which there is no contact.
        distance: of two units beyond which there is none; by default a twelfth of the ligaments'
            length, or the gap that the constraints ask for if that is smaller.
    """

    law: Literal["angle", "geometric"]
    stiffness: ContactStiffness
    barrier_angle: Angle
    cutoff_angle: Angle
    distance: Length | None = None
