"""The tables of the checks in a study file: declarations only."""

from __future__ import annotations

from typing import Literal

from pydantic import StrictBool

from ...core.quantities import Value, declaration, quantity, variables, whole_number
from ...drives.catalogue_flexible import FlexibleCouplingValues
from ...drives.gear_rating import GearRating
from ...reading.lists import TableList
from ...reading.tables import file_key
from ...study.file_section import FileSection, of_named
from ...study.relay import CLASSES

ROLLING, PLAIN = ("ball", "roller"), "plain"
KINDS = (*ROLLING, PLAIN)
"""The kinds of bearings."""
STATIC_SAFETY = {"ball": 1.5, "roller": 3.0}
"""Static safety by kind of rolling bearing that is asked for where a file does not give one: that of shocks."""


@declaration
class BearingTable:
    """A bearing in the place of a pin: the ratings of a rolling bearing, or sizes and limits of a plain one."""

    C: Value = quantity("N", "dynamic load rating of a rolling bearing", above=0.0, max=1e9)
    C0: Value = quantity("N", "static load rating of a rolling bearing", above=0.0, max=1e9)
    life: Value = quantity(
        "s", "rating life that is asked for", default=7.2e7, min=3.6e5, max=1e11, kind="hours"
    )
    life_factor: Value = quantity(
        "1",
        "factor a1 aISO of the modified rating life, for reliability, lubrication and contamination",
        default=1.0,
        above=0.0,
        max=50.0,
    )
    static_safety: Value = quantity("1", "static safety C0/F that is asked for", above=0.0, max=100.0)
    elements: Value = whole_number("number of rolling elements of a row", min=3.0, max=1000.0)
    diameter_ratio: Value = quantity(
        "1",
        "diameter of a rolling element, times the cosine of the contact angle, over the pitch diameter",
        default=0.2,
        min=0.0,
        max=0.9,
    )
    diameter: Value = quantity("m", "diameter of a plain bearing", above=0.0, max=10.0)
    width: Value = quantity("m", "width of a plain bearing", above=0.0, max=10.0)
    pressure: Value = quantity("N/m2", "permitted pressure p of a plain bearing", above=0.0, kind="stress")
    speed: Value = quantity("m/s", "permitted sliding speed v of a plain bearing", above=0.0)
    pv: Value = quantity(
        "W/m2", "permitted mean of pressure times sliding speed of a plain bearing", above=0.0, kind="pv"
    )


BEARING_KEYS = {
    " or ".join(ROLLING): ("C", "C0", "life", "life_factor", "static_safety", "elements", "diameter_ratio"),
    PLAIN: ("diameter", "width", "pressure", "speed", "pv"),
}
"""By kinds, the keys that they alone have."""
NEEDED = {"ball": ("C",), "roller": ("C",), PLAIN: ("diameter", "width")}
"""By kind, the keys that a bearing must have."""

BEARINGS = TableList(
    "bearing",
    title="Bearing that a pin gets, by the name of the pin",
    description="bearings",
    most=100,
    declared=BearingTable,
    keys={
        "kind": file_key(Literal[KINDS], None, "kind of the bearing"),
    },
    conditions={
        "required": ["kind"],
        "allOf": [
            {
                "if": {"properties": {"kind": {"enum": list(kinds)}}, "required": ["kind"]},
                "then": {
                    "required": list(NEEDED[kinds[0]]),
                    "not": {"anyOf": [{"required": [key]} for key in others]},
                },
            }
            for kinds, others in zip((ROLLING, (PLAIN,)), reversed(BEARING_KEYS.values()), strict=True)
        ],
    },
    follows={"static_safety": "1.5 for balls, 3 for rollers"},
)


@declaration
class RelayTable:
    """A thermal overload relay, and the stall of the motor that it protects."""

    setting: Value = quantity(
        "A",
        "setting of the relay; 0: the rated current of the motor, in the phases of a delta 1/sqrt(3) of it",
        default=0.0,
        min=0.0,
    )
    stall_time: Value = quantity(
        "s",
        "time for which the rotor of a warm motor may be locked; 0: that of the nameplate",
        default=0.0,
        min=0.0,
        max=1e4,
    )
    stall_current: Value = quantity(
        "A", "current with the rotor locked; 0: that of the nameplate", default=0.0, min=0.0
    )


IN_PHASES = "phases"
RELAY_PLACES = (IN_PHASES, "line")
"""The places of the relay of a star-delta starter."""


@declaration
class StartingTable:
    """The starts of a motor on the line."""

    per_hour: Value = quantity(
        "1", "starts an hour that are asked for; 0: those of [sizing]", default=0.0, min=0.0, max=1e4
    )
    permitted: Value = quantity(
        "1",
        "permitted starts an hour of the bare rotor without load; 0: as in the catalogue",
        default=0.0,
        min=0.0,
        max=1e5,
    )


@declaration
class GearRatingTable(GearRating):
    """The ratings of the gear that is checked, and what its maker permits in peaks."""

    exponent: Value = quantity(
        "1",
        "exponent p of Woehler's line of its teeth, for the torque of equal damage; 0: the largest torque of the "
        "cycle in place of it, as the same teeth meet it in each turn",
        default=0.0,
        min=0.0,
        max=50.0,
    )
    peak_factor: Value = quantity(
        "1",
        "permitted torque in peaks and starts over the rated torque; 0: gear.start_factor, times application_factor "
        "for a gear of a catalogue and for gear.torque_limit",
        default=0.0,
        min=0.0,
        max=20.0,
    )
    peak_overhung_load: Value = quantity(
        "N", "permitted radial force on the output shaft in events; 0: unknown", default=0.0, min=0.0
    )


OF_ROW = tuple(variable.name for variable in variables(FlexibleCouplingValues))
"""The values of [flexible_coupling] that each coupling of a catalogue has."""
PLACES = ("motor", "crank")
"""The places of a flexible coupling: on the motor's shaft, or on the crank's shaft behind the gear."""


@declaration
class FlexibleCouplingTable:
    """A flexible coupling by DIN 740-2; 0 stands for a value that is unknown."""

    rated_torque: Value = quantity("N.m", "rated torque TKN", default=0.0, min=0.0)
    peak_torque: Value = quantity("N.m", "peak torque TKmax", default=0.0, min=0.0)
    alternating_torque: Value = quantity(
        "N.m", "alternating torque TKW that it carries for ever at 10 Hz", default=0.0, min=0.0
    )
    stiffness: Value = quantity("N.m/rad", "dynamic torsional stiffness CTdyn", default=0.0, min=0.0)
    damping: Value = quantity(
        "1",
        "relative damping psi: energy of damping over elastic energy of a swing",
        default=0.0,
        min=0.0,
        max=10.0,
    )
    J: Value = quantity("kg.m2", "inertia, at its own shaft", default=0.0, min=0.0)
    largest_speed: Value = quantity("rad/s", "permitted speed", default=0.0, min=0.0, kind="speed")
    temperature_factor: Value = quantity(
        "1", "temperature factor St, by its maker for the elastic part", default=1.0, min=1.0, max=10.0
    )
    start_factor: Value = quantity(
        "1",
        "start factor SZ; 0: 1 up to 120 starts an hour, 1.3 up to 240",
        default=0.0,
        min=0.0,
        max=10.0,
    )
    surge_factor: Value = quantity(
        "1",
        "surge factor SA: torque of the elastic coupling over the sudden torque of a rigid one; 2 is that of a jump "
        "without damping",
        default=2.0,
        min=1.0,
        max=10.0,
    )


@declaration
class MotorShaftTable:
    """The shaft of the motor; 0 stands for a value that is unknown."""

    overhung_load: Value = quantity("N", "permitted radial force on the shaft", default=0.0, min=0.0)
    pulley_diameter: Value = quantity("m", "diameter of a pulley on it", default=0.0, min=0.0, max=10.0)
    tension_factor: Value = quantity(
        "1",
        "radial force of the belt over that of the torque at the rim, by its maker",
        default=0.0,
        min=0.0,
        max=10.0,
    )


GIVEN_NOTCH, SHOULDER, KEYWAY, PRESS_FIT = "given", "shoulder", "keyway", "press fit"
NOTCHES = ("none", GIVEN_NOTCH, SHOULDER, KEYWAY, PRESS_FIT)
NOTCH_KEYS = {
    GIVEN_NOTCH: ("beta_bending", "beta_tension", "beta_torsion"),
    SHOULDER: ("radius", "outer_diameter"),
}
"""By notch, the keys that it alone has."""
STEELS = ("structural", "quenched", "nitrided", "case-hardened", "case-hardened CrNiMo")
PARTS = ("crank", "frame", "link")
"""The parts on which a section is: it turns with the crank, stands in the frame, or is on a link whose angle to the
force is not known."""
RATIO, CONSTANT = "ratio", "constant"


@declaration
class SectionTable:
    """A round section of a shaft, an axle or a link."""

    diameter: Value = quantity("m", "diameter of the section", above=0.0, max=0.5, kind="millimetres")
    bore: Value = quantity("m", "bore in it", default=0.0, min=0.0, max=0.5, kind="millimetres")
    arm: Value = quantity("m", "lever arm by which the force of the pin bends it", min=0.0, max=10.0)
    torsion_share: Value = quantity(
        "1", "share of the torque of the {driver} that it carries", default=1.0, min=0.0, max=1.0
    )
    axial_share: Value = quantity(
        "1", "share of the force of the pin that pulls and pushes it", default=0.0, min=0.0, max=1.0
    )
    tensile_strength: Value = quantity("N/m2", "tensile strength", above=0.0, max=5e9, kind="stress")
    yield_strength: Value = quantity("N/m2", "yield strength", above=0.0, max=5e9, kind="stress")
    effective_diameter: Value = quantity(
        "m",
        "diameter in the heat treatment; 0: the largest of the section",
        default=0.0,
        min=0.0,
        max=0.5,
        kind="millimetres",
    )
    roughness: Value = quantity(
        "m", "roughness Rz of the surface", default=2e-5, min=0.0, max=1e-3, usual=(1e-7, 1e-3)
    )
    hardening_factor: Value = quantity(
        "1", "factor KV of a surface that is hardened or rolled", default=1.0, min=1.0, max=3.0
    )
    beta_bending: Value = quantity("1", "notch factor of bending, of the notch given", min=1.0, max=10.0)
    beta_tension: Value = quantity("1", "notch factor of tension, of the notch given", min=1.0, max=10.0)
    beta_torsion: Value = quantity("1", "notch factor of torsion, of the notch given", min=1.0, max=10.0)
    radius: Value = quantity(
        "m", "radius of the fillet of a shoulder", above=0.0, max=0.5, kind="millimetres"
    )
    outer_diameter: Value = quantity(
        "m", "larger diameter of a shoulder", above=0.0, max=1.0, kind="millimetres"
    )
    safety: Value = quantity("1", "safety that is asked for", default=1.2, min=1.0, max=10.0)


SECTION_NEEDS = ("diameter", "arm", "notch", "tensile_strength", "yield_strength")
"""The keys that a section must have."""

SECTIONS = TableList(
    "section",
    title="Section of a shaft, an axle or a link, by a name of its own",
    description="sections",
    most=100,
    declared=SectionTable,
    keys={
        "pin": file_key(str, "", "pin whose force bends it, by the first word of its title, or all of it"),
        "on": file_key(Literal[PARTS], PARTS[0], "part that it is on"),
        "notch": file_key(Literal[NOTCHES], None, "notch in it"),
        "steel": file_key(Literal[STEELS], None, "kind of steel, whose strengths fall with the diameter"),
        "hard_surface": file_key(StrictBool, False, "whether its surface layer is hard"),
        "mean_stress": file_key(
            Literal[RATIO, CONSTANT],
            RATIO,
            "whether mean stress and amplitude grow in one ratio, or the mean is constant",
        ),
    },
    conditions={"required": list(SECTION_NEEDS)},
    follows={
        "pin": "the bearing of the crank",
        "steel": "strengths are those at the diameter",
        "effective_diameter": "the largest diameter of the section",
        "beta_bending": "1",
        "beta_tension": "1",
        "beta_torsion": "1",
    },
)

TABLES = {
    "bearing": of_named(BEARINGS),
    "section": of_named(SECTIONS),
    "relay": FileSection(
        RelayTable,
        optional=True,
        keys={
            "trip_class": file_key(
                Literal[tuple(relay_class.name for relay_class in CLASSES)],
                None,
                "trip class of IEC 60947-4-1",
            ),
            "place": file_key(
                Literal[RELAY_PLACES],
                IN_PHASES,
                "place of the relay of a star-delta starter: in the phases of the delta, set to "
                "1/sqrt(3) of the rated current, or in the supply line",
            ),
        },
        title="Thermal overload relay",
        follows={
            "trip_class": "10, a heavier one if the start needs it, or 5 if 10 trips too late in a stall",
            "setting": "the rated current of the motor, in the phases of a delta 1/sqrt(3) of it",
            "stall_time": "that of the nameplate",
            "stall_current": "that of the nameplate",
        },
    ),
    "starting": FileSection(
        StartingTable,
        optional=True,
        title="Starts per hour",
        follows={
            "per_hour": "sizing.starts_per_hour, if the file has [sizing]",
            "permitted": "the permitted starts in the catalogue, if it has them",
        },
    ),
    "gear_rating": FileSection(
        GearRatingTable,
        optional=True,
        title="Ratings of the gear",
        follows={
            "rated_torque": "gear.torque_limit over the application factor, if the file gives it",
            "peak_factor": "gear.start_factor",
        },
    ),
    "flexible_coupling": FileSection(
        FlexibleCouplingTable,
        optional=True,
        keys={
            "designation": file_key(
                str, "", "designation of a flexible coupling of the catalogues that the file names"
            ),
            "place": file_key(Literal[PLACES], "motor", "shaft that it is on"),
        },
        title="Flexible coupling",
        follows={"start_factor": "by the starts an hour"},
    ),
    "motor_shaft": FileSection(MotorShaftTable, optional=True, title="Shaft of the motor"),
}
"""By its name, each table of a study file."""
