"""The part of the tire or of the rig that an effect belongs to, as the page groups effects."""

PARTS = {
    "belt": (
        *("centrifugal", "rotary_inertia", "belt_extension", "belt_shear", "dynamic_stiffening"),
        *("belt_bending", "nonuniformity"),
    ),
    "sidewall": (
        *("sidewall_load", "sidewall_pressure", "sidewall_damping", "temperature", "carcass"),
        *("ply_steer", "conicity"),
    ),
    "tread": (
        *("tread_friction", "tread_load", "tread_wear", "stiffness_load", "stiffness_pressure"),
        *("stiffness_temperature", "stiffness_drift", "friction_load", "friction_pressure"),
        *("friction_temperature", "friction_speed", "friction_drift"),
    ),
    "contact": (
        *("trailing_sliding", "hydroplaning", "roughness", "camber", "load_transfer", "traction"),
        *("ring_pressure", "brush_camber", "relaxation", "combined_slip"),
    ),
    "gages": (
        *("gage_length", "low_pass", "gage_gain", "gage_saturation", "gage_offset"),
        *("gain_load", "gain_pressure", "gain_speed"),
    ),
    "rig": ("gage_drift", "angle_zero"),
}
"""Effects of the catalogue by part."""
_STAGES = {
    "stiffness": "sidewall",
    "inertia": "belt",
    "tread": "tread",
    "contact": "contact",
    "strain": "belt",
    "gage": "gages",
    "brush": "tread",
}


def part_of(effect: str, stage: str = "") -> str:
    """Return the part of an effect; of a user's own by the stage that it acts on."""
    found = (part for part, names in PARTS.items() if effect in names)
    return next(found, _STAGES.get(stage, "rig"))
