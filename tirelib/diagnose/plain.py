"""What plain tires show beside the shear of their belt, and what of it looks like an effect.

Every tire's belt shears and the base ring's does not. Beside a fitted shear a plain tire leaves
little, but what it leaves may go with an effect of the catalogue that is none.
"""

from collections.abc import Sequence

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.ensemble import ALIKE, BENT
from tirelib.effects import CATALOGUE, Effect

SHEAR = CATALOGUE["belt_shear"]
BELT = frozenset({SHEAR.name})
"""What every tire has and the base has not: named, it raises no bar for what is hidden beside."""
SHOWN = {
    **{effect: (size,) for effect, size in ALIKE.items()},
    CATALOGUE["gage_saturation"]: (0.007,),
    CATALOGUE["tread_friction"]: (0.03, BENT[0]),
}
"""Standard deviations, in their units, of what plain tires show of effects beside the shear. Tires
of finite elements show up to 0.01 of `gage_saturation` and, without bending the flat piece, up to
0.045 of `tread_friction`. As parts of the covariance (`ALIKE`) these would hide the friction of a
tread that only pulls the ring."""
BY_ITSELF, BESIDE = 3.0, 6.0
"""Standard deviations up to which such a strength may be structure's: of an effect by itself, and
of one beside others, whose laws are right but roughly."""


def usual(effects: Sequence[Effect], effect: Effect, strength: FloatArray) -> bool:
    """Return whether a plain tire may show a strength of an effect beside those of a model.

    Without the shear among them nothing is known to be usual.

    Parameters
    ----------
    effects : sequence of Effect
        That the model has.
    effect : Effect
        That is added to it.
    strength : shape (components,)
    """
    if SHEAR not in effects or effect not in SHOWN:
        return False
    others = {each.name for each in effects} - BELT
    size = float(np.linalg.norm(strength / np.array(SHOWN[effect])))
    return size < (BESIDE if others else BY_ITSELF)
