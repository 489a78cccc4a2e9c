"""Ways to plant a fault, and to assert what the check says of it."""

from collections.abc import Callable
from dataclasses import replace

from tirelib.campaign import CampaignFault, FloatArray
from tirelib.campaign.mdf import Group


def the_one(problems: list[CampaignFault], severity: str = "error") -> str:
    """Return the only problem as text; fail and show them when there are others."""
    assert [p.severity for p in problems] == [severity], "\n".join(map(str, problems))
    assert problems[0].where
    assert problems[0].given
    assert problems[0].allowed
    assert problems[0].remedy
    return str(problems[0])


def says(text: str, *parts: str) -> None:
    """Assert that every part stands in the text."""
    missing = [part for part in parts if part not in text]
    assert not missing, f"{missing} not in: {text}"


def channel(which: str, **new: object) -> Callable[[Group], Group]:
    """Return a change of a group that edits one channel."""

    def apply(group: Group) -> Group:
        edited = [replace(c, **new) if c.name == which else c for c in group.channels]
        return replace(group, channels=tuple(edited))

    return apply


def put(gage: int, where: object, value: float) -> Callable[[FloatArray], None]:
    def apply(strain: FloatArray) -> None:
        strain[gage, where] = value

    return apply
