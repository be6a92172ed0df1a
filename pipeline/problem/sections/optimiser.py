"""Describes the search for a design."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.problem.fields import Count, Length, Section


class Method(Section):
    """The budget of one optimisation method.

    Attributes:
        evaluations: of loss and gradient, at most.
    """

    evaluations: Count


class Methods(Section):
    """The optimisation methods to run; the better design is shipped.

    Attributes:
        sqp: sequential quadratic programming in a trust region.
        mma: method of moving asymptotes, as the authors do.
    """

    sqp: Method | None = None
    mma: Method | None = None

    @property
    def chosen(self) -> dict[str, Method]:
        """Returns the methods asked for, by name."""
        pairs = {"sqp": self.sqp, "mma": self.mma}
        return {name: method for name, method in pairs.items() if method is not None}


class Optimiser(Section):
    """Search for the design; lengths are shifts of vertices.

    Attributes:
        methods: one or both.
        start: from the initial lattice; or, in a preset, from the design of the study itself, or as
            near to it as this cloak and symmetry allow; or, of several designs, from the previous
            one, the first from that of the study.
        geometric: the budget with which a design by the angle law of contact is optimised again
            with contact on distance, where its loss depends on the law.
        angle: the budget with which SQP first optimises a design for contact on distance by the
            angle law, whether it overlaps and snaps or not; none by default.
        symmetry: that the design is to have.
        as_built: whether the slots that hold the shims turn with the design, by up to 30 degrees
            against the ligaments: it is then optimised with its shims bent as drawn, and all motion
            counted from where it comes to rest; for convex units.
        trust_radius: at the start.
        trust_radius_max: at most.
        kick: random shifts with which an optimisation that has ended goes on, as far as its
            budget allows, and with which descents after the first start.
        seed: of the kicks.
        descents: number of optimisations by SQP, with this seed and the next ones; the best is
            shipped, the losses of all are kept.
    """

    methods: Methods
    start: Literal["initial", "study", "previous"] = "initial"
    geometric: Method = Method(evaluations=60)
    angle: Method | None = None
    symmetry: Literal["none", "C4", "mirror_x", "mirror_y"] = "none"
    as_built: bool = False
    trust_radius: Length = 0.25
    trust_radius_max: Length = 1.0
    kick: Length = 0.15
    seed: Annotated[int, Field(ge=0, strict=True)] = 0
    descents: Annotated[int, Field(ge=1, le=100, strict=True)] = 1
