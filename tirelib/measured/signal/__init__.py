"""From raw strain to turns: contacts, offset, low-pass without phase shift, time to angle.

One definition serves batch, stream and FMU. A turn ends with its contact. Turn rate and offset come
from the turn that precedes the contact, so an estimate is ready twenty degrees of wheel angle (and
half the filter) after the trailing edge. Source: dissertation, section 3.4.
"""

from tirelib.measured.signal.contacts import Contact, ContactFinder
from tirelib.measured.signal.lowpass import LowPass
from tirelib.measured.signal.turns import Turn, TurnCutter, Turns, cut_turns, stack_turns

__all__ = [
    "Contact",
    "ContactFinder",
    "LowPass",
    "Turn",
    "TurnCutter",
    "Turns",
    "cut_turns",
    "stack_turns",
]
