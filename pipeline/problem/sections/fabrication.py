"""Defines the section `fabrication` of a problem, whose defaults are the paper's."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import Gap, Length, Modulus, Positive, Section, Share, fault
from sim.structure import SlotRoom

DENSITIES = {
    "PLA": 1.24e-9,
    "PETG": 1.27e-9,
    "ABS": 1.04e-9,
    "ASA": 1.07e-9,
    "PA12": 1.01e-9,
    "PMMA": 1.18e-9,
    "POM": 1.41e-9,
}
"""Of the solid materials, tonne/mm^3 (makers' data sheets)."""

_LEAST_LABEL = 2.0  # mm; smaller letters can neither be engraved nor printed
_LEAST_RIM = 2.0  # mm around a bolt's hole
_MOST_PLAY = 1.0  # mm beside a unit in its pocket
_WIDEST_SLOT = 8.0  # mm
_WIDEST_TAB = 1.0  # mm, with the kerf
_THINNEST_LAYER = 1.0  # mm; thinner sheets warp under the laser, and glue adds up

Clearances = Annotated[tuple[Gap, ...], Field(min_length=1, max_length=20)]


def _check_room(name: str, sides: tuple[float, float], margin: float) -> None:
    """Refuses a sheet or bed on which the margin along its rim leaves no room for parts.

    Raises:
        PydanticCustomError: naming the sides that would do.
    """
    if min(sides) <= 2.0 * margin:
        what = f"a margin of {margin:g} mm leaves no room on a {name}"
        remedy = f"give more than {2.0 * margin:g} mm a side, or a smaller `margin`"
        raise fault(f"{what} of {sides[0]:g} mm by {sides[1]:g} mm", remedy, name)


class Slots(Section):
    """Slots at the vertices that hold the shims.

    Attributes:
        direction: where a slot points: along its ligament, which leaves the shim straight, to the
            unit's centroid, or along the bisector of its corner. Where the walls would be too thin,
            it turns; then both ends of a shim are chosen together, so that it is bent least.
        depth: wanted depth from the vertex.
        depth_min: least length in which the shim is held, where there is no more room.
        depth_max: largest depth, where only a deeper slot has thick enough walls.
        thicken: most that a unit may grow beside a slot, where nothing else gives thick walls.
        clearance: beside the shim on both sides: width = shim thickness + 2 clearance.
        tip: the tips beside the mouth are cut back to walls of this thickness.
    """

    direction: Literal["centroid", "ligament", "bisector"] = "ligament"
    depth: Length = 3.0
    depth_min: Length = 1.0
    depth_max: Length = 5.0
    clearance: Gap = 0.1
    tip: Gap = 0.1
    thicken: Gap = 1.0

    @model_validator(mode="after")
    def _depths_ascend(self) -> Self:
        if self.depth_min > self.depth_max:
            what = f"the least depth is above the largest, {self.depth_max:g} mm"
            raise fault(what, f"give at most {self.depth_max:g} mm", "depth_min")
        if not self.depth_min <= self.depth <= self.depth_max:
            what = f"{self.depth:g} mm is not within the limits of the depth"
            remedy = f"keep it from {self.depth_min:g} mm to {self.depth_max:g} mm"
            raise fault(what, remedy, "depth")
        return self


class Tabs(Section):
    """Tabs that hold the pieces of foil in their sheet until they are twisted out.

    They are on the edges that stand level with the faces of the units, within the slots.

    Attributes:
        width: of the foil that is left between two cuts.
        count: tabs of each piece.
    """

    width: Length = 0.4
    count: Literal[1, 2, 3, 4] = 2


class Shims(Section):
    """Strips that join the units.

    Attributes:
        thickness: of the foil.
        young_modulus: of the foil, for its moment before any load; that of polyester.
        prebend_strain: largest strain of a shim before any load; beyond it nothing is drawn.
        spares: extra pieces of each length, as a share; at least one.
        tabs: that hold the pieces in their sheet; null cuts each piece free.
        strips: one strip for each row and each column instead; refused, as slots end inside units.
    """

    thickness: Length = 0.25
    young_modulus: Modulus = 4500.0
    prebend_strain: Share = 0.3
    spares: Share = 0.1
    tabs: Tabs | None = Tabs()
    strips: bool = False

    @model_validator(mode="after")
    def _slots_end_inside(self) -> Self:
        if self.strips:
            what = "slots end inside the units: a strip cannot go on from one to the next"
            remedy = (
                "leave it out (slots right across would cut a unit in two); tabs hold the pieces"
            )
            raise fault(what, f"{remedy} of a sheet together", "strips")
        return self


class Labels(Section):
    """Ids on the parts.

    Attributes:
        height: of the letters; smaller where there is no room.
        stroke: width of their strokes; 0.4 mm at most on arrows and the coupon, 0.5 mm on the
            fixture, and less on small letters.
        depth: of their strokes; in a thin plate of the fixture half of its thickness.
    """

    height: Length = 3.0
    stroke: Length = 0.5
    depth: Length = 0.4

    @model_validator(mode="after")
    def _legible(self) -> Self:
        if self.height < _LEAST_LABEL:
            what = f"letters of {self.height:g} mm cannot be read"
            raise fault(what, f"give at least {_LEAST_LABEL:g} mm", "height")
        return self


class Markers(Section):
    """Dots on top of the units for the tracking.

    Attributes:
        kind: none, recesses to be filled with paint, or raised dots; the template has them always.
        count: dots per unit, on a line through its centroid if there is room; one if not.
        spread: distance of the outer dots.
        diameter: of a dot; both are smaller where there is no room.
        depth: of a recess, or height of a raised dot.
    """

    kind: Literal["none", "recess", "dots"] = "none"
    count: Literal[1, 2, 3] = 2
    spread: Length = 6.0
    diameter: Length = 2.0
    depth: Length = 0.4


class Laser(Section):
    """Sheets for the laser cutter.

    Attributes:
        kerf: width of the cut; the drawings are also written without compensation. Units that are
            printed only are drawn without it alone, for reference.
        sheet: width and height of a sheet.
        margin: free rim of a sheet.
        gap: smallest distance of two parts.
        template_thickness: of the template with the tracking dots and of the spacer comb.
        aspect_ratio: largest depth of a slot that is cut over its width; a unit that is thicker
            is glued from layers.
        pin: diameter of the pins that align the layers of a unit.
    """

    kerf: Gap = 0.15
    sheet: tuple[Length, Length] = (600.0, 300.0)
    margin: Gap = 5.0
    gap: Length = 2.0
    template_thickness: Length = 1.0
    aspect_ratio: Positive = 3.0
    pin: Length = 1.5

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        _check_room("sheet", self.sheet, self.margin)
        return self


class Print(Section):
    """Plates for the printer.

    Attributes:
        bed: width and depth of the bed.
        margin: free rim of the bed.
        gap: smallest distance of two parts.
        first_layer_inset: how far the first layer is drawn in, against its squeezing out.
        layer: height of the first layer.
        infill: share of the parts' inside that is printed. Left out, 0.15 for a slow load, where
            units are to be rigid and their mass plays no part, and for motions in time the share
            that the density asks for.
    """

    bed: tuple[Length, Length] = (250.0, 210.0)
    margin: Gap = 5.0
    gap: Length = 2.0
    first_layer_inset: Gap = 0.0
    layer: Length = 0.2
    infill: Annotated[float, Field(ge=0.0, le=1.0)] | None = None

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        _check_room("bed", self.bed, self.margin)
        return self


class Fixture(Section):
    """Holds of the specimen: pads on a breadboard, grips on bolts, jig.

    Attributes:
        clearance: between a unit and its pocket.
        pad: edge of a corner pad's square, and width of a grip's flange.
        hole: diameter of the bolt holes.
        grid: pitch of the breadboard.
        bolt_pitch: pitch of the bolts of a grip.
        base: thickness of clamps and grips below the units, and of the back of adapters; the jig
            has 2.4 mm.
        pocket: depth of the jig's pockets, and length of the fingers of adapters, at most the
            height of the units; jaws of clamps and grips are as high as these.
    """

    clearance: Gap = 0.15
    pad: Length = 15.0
    hole: Length = 4.2
    grid: Length = 25.4
    bolt_pitch: Length = 40.0
    base: Length = 4.0
    pocket: Length = 4.0

    @model_validator(mode="after")
    def _holds(self) -> Self:
        if self.hole > self.pad - 2.0 * _LEAST_RIM:
            what = f"a hole of {self.hole:g} mm leaves no rim on a pad of {self.pad:g} mm"
            raise fault(what, f"give at most {self.pad - 2.0 * _LEAST_RIM:g} mm", "hole")
        if self.clearance > _MOST_PLAY:
            what = f"with {self.clearance:g} mm of clearance a pocket holds no unit"
            raise fault(what, f"give at most {_MOST_PLAY:g} mm", "clearance")
        return self


class Fabrication(Section):
    """Settings of all that is made of a design.

    Attributes:
        material: of the units; its density gives what a print weighs. A unit's mass in the bill of
            materials is that of the study, `material.density` times its area.
        thickness: height of the units.
        minimum_wall: thinnest wall at a slot's inner end and between two slots.
        minimum_gap: smallest distance of two units.
        fillet_radius: of the units' corners.
        paper: size of the pages of the assembly sheet.
        slots: at the vertices, for the shims.
        shims: that join the units.
        labels: ids on the parts.
        markers: dots for the tracking.
        laser: sheets for the laser cutter.
        print: plates for the printer.
        fixture: what holds the specimen.
        coupon: clearances that the test piece has, to find the one that fits.
    """

    material: Literal["PLA", "PETG", "ABS", "ASA", "PA12", "PMMA", "POM"] = "PLA"
    thickness: Length = 8.1
    minimum_wall: Length = 0.8
    minimum_gap: Gap = 0.1
    fillet_radius: Gap = 0.0
    paper: Literal["A4", "Letter"] = "A4"
    slots: Slots = Slots()
    shims: Shims = Shims()
    labels: Labels = Labels()
    markers: Markers = Markers()
    laser: Laser = Laser()
    print: Print = Print()
    fixture: Fixture = Fixture()
    coupon: Clearances = (0.0, 0.05, 0.1, 0.15, 0.2)

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        sunk = self.labels.depth + self.markers.depth * (self.markers.kind == "recess")
        if sunk > self.thickness / 2.0:
            what = f"letters and dots {sunk:g} mm deep take more than half of the thickness"
            raise fault(what, f"keep them within {self.thickness / 2.0:g} mm", "labels", "depth")
        if self.print.first_layer_inset > self.minimum_wall / 2.0:
            what = "the first layer is drawn in by more than half of the thinnest wall"
            remedy = f"give at most {self.minimum_wall / 2.0:g} mm"
            raise fault(what, remedy, "print", "first_layer_inset")
        if self.shims.thickness + 2.0 * max(self.coupon) > _WIDEST_SLOT:
            what = f"the coupon has no room for slots wider than {_WIDEST_SLOT:g} mm"
            raise fault(what, "give smaller clearances", "coupon")
        widest = min(self.slots.depth_min, _WIDEST_TAB)
        most = widest - self.laser.kerf
        if self.shims.tabs is not None and self.shims.tabs.width > most:
            if most <= 0.0:
                what = f"a cut of {self.laser.kerf:g} mm leaves no tabs that stand within the slots"
                raise fault(what, f"give less than {widest:g} mm", "laser", "kerf")
            what = f"tabs of {self.shims.tabs.width:g} mm do not stand within the slots"
            raise fault(what, f"give at most {most:g} mm", "shims", "tabs", "width")
        return self

    @property
    def plain_height(self) -> float:
        """Height at which a unit has neither letters nor dots, which may take half of it, mm."""
        recess = self.markers.depth if self.markers.kind == "recess" else 0.0
        return (self.labels.depth + self.thickness - recess) / 2.0

    @property
    def laser_layers(self) -> int:
        """Number of equal layers that a unit is cut in, for its slots to be cut through."""
        return math.ceil(self.thickness / (self.laser.aspect_ratio * self.slot_width) - 1e-9)

    @property
    def laser_sheet_thickness(self) -> float:
        """Thickness of the sheet that units, or their layers, are cut from, mm."""
        return self.thickness / self.laser_layers

    @property
    def laminated(self) -> bool:
        """Tests that units are cut by laser in layers, to be pinned and glued."""
        return self.laser_layers > 1 and self.laser_sheet_thickness >= _THINNEST_LAYER

    @property
    def laser_cuts_units(self) -> bool:
        """Tests that units can be cut by laser, whole or in layers, in place of printing them."""
        return self.laser_layers == 1 or self.laminated

    def kerf_of(self, kind: str) -> float:
        """Looks up the cut that sheets of a kind make good; none where no laser cuts it, mm."""
        drawn_for_reference = kind in {"units", "coupon"} and not self.laser_cuts_units
        return 0.0 if drawn_for_reference else self.laser.kerf

    @property
    def laser_route(self) -> str:
        """Tells in words how units can be cut by laser, if they can."""
        layers, each = self.laser_layers, self.laser_sheet_thickness
        if layers == 1:
            return f"cut from sheet of {self.thickness:g} mm"
        slot = f"slots of {self.slot_width:g} mm are cut {self.laser.aspect_ratio:g} times as deep"
        if not self.laminated:
            return f"print only: {slot}, which would take {layers} layers of {each:.2f} mm"
        return f"cut {layers} times from sheet of {each:.2f} mm, pin and glue: {slot}"

    @property
    def solid_density(self) -> float:
        """Density of the units' material, tonne/mm^3."""
        return DENSITIES[self.material]

    @property
    def slot_width(self) -> float:
        """Width of a slot in mm."""
        return self.shims.thickness + 2.0 * self.slots.clearance

    @property
    def slot_room(self) -> SlotRoom:
        """Room that slots along the ligaments need, which leave the shims straight."""
        cut = self.slots
        return SlotRoom(cut.depth_min, cut.depth_max, self.slot_width, self.minimum_wall, cut.tip)
