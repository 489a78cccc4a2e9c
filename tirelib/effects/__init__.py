"""Physical effects: each a law of a dozen lines that changes the model's state by a strength."""

from collections.abc import Mapping
from types import MappingProxyType

from tirelib.effects import (
    angle_zero,
    belt_bending,
    belt_extension,
    belt_shear,
    brush_camber,
    camber,
    carcass,
    centrifugal,
    combined_slip,
    conicity,
    dynamic_stiffening,
    friction_drift,
    friction_load,
    friction_pressure,
    friction_speed,
    friction_temperature,
    gage_drift,
    gage_gain,
    gage_length,
    gage_offset,
    gage_saturation,
    gain_load,
    gain_pressure,
    gain_speed,
    hydroplaning,
    load_transfer,
    low_pass,
    nonuniformity,
    ply_steer,
    relaxation,
    ring_pressure,
    rotary_inertia,
    roughness,
    sidewall_damping,
    sidewall_load,
    sidewall_pressure,
    stiffness_drift,
    stiffness_load,
    stiffness_pressure,
    stiffness_temperature,
    temperature,
    traction,
    trailing_sliding,
    tread_friction,
    tread_load,
    tread_wear,
)
from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import Effect, effect
from tirelib.effects.state import State

__all__ = ["CATALOGUE", "BrushState", "Effect", "State", "effect"]

CATALOGUE: Mapping[str, Effect] = MappingProxyType(
    {
        # sidewall
        "sidewall_load": sidewall_load.sidewall_load,
        "sidewall_pressure": sidewall_pressure.sidewall_pressure,
        "sidewall_damping": sidewall_damping.sidewall_damping,
        "temperature": temperature.temperature,
        # belt
        "centrifugal": centrifugal.centrifugal,
        "rotary_inertia": rotary_inertia.rotary_inertia,
        "belt_extension": belt_extension.belt_extension,
        "belt_shear": belt_shear.belt_shear,
        "dynamic_stiffening": dynamic_stiffening.dynamic_stiffening,
        # tread and contact
        "tread_friction": tread_friction.tread_friction,
        "tread_load": tread_load.tread_load,
        "tread_wear": tread_wear.tread_wear,
        "trailing_sliding": trailing_sliding.trailing_sliding,
        "hydroplaning": hydroplaning.hydroplaning,
        "roughness": roughness.roughness,
        # lateral: gages beside the middle, slip, camber
        "camber": camber.camber,
        "belt_bending": belt_bending.belt_bending,
        "load_transfer": load_transfer.load_transfer,
        "traction": traction.traction,
        # tire
        "nonuniformity": nonuniformity.nonuniformity,
        # gage
        "gage_length": gage_length.gage_length,
        "low_pass": low_pass.low_pass,
        "gage_gain": gage_gain.gage_gain,
        "gage_saturation": gage_saturation.gage_saturation,
        "gage_offset": gage_offset.gage_offset,
        "gage_drift": gage_drift.gage_drift,
        "gain_load": gain_load.gain_load,
        "gain_pressure": gain_pressure.gain_pressure,
        "gain_speed": gain_speed.gain_speed,
        "angle_zero": angle_zero.angle_zero,
        # brush: forces, not strain
        "ring_pressure": ring_pressure.ring_pressure,
        "stiffness_load": stiffness_load.stiffness_load,
        "stiffness_pressure": stiffness_pressure.stiffness_pressure,
        "stiffness_temperature": stiffness_temperature.stiffness_temperature,
        "stiffness_drift": stiffness_drift.stiffness_drift,
        "friction_load": friction_load.friction_load,
        "friction_pressure": friction_pressure.friction_pressure,
        "friction_temperature": friction_temperature.friction_temperature,
        "friction_speed": friction_speed.friction_speed,
        "friction_drift": friction_drift.friction_drift,
        "brush_camber": brush_camber.brush_camber,
        "carcass": carcass.carcass,
        "ply_steer": ply_steer.ply_steer,
        "conicity": conicity.conicity,
        "relaxation": relaxation.relaxation,
        "combined_slip": combined_slip.combined_slip,
    }
)
"""Every effect of the library by name: the chain from sidewall to gage, then the brush."""
