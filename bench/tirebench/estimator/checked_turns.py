"""Turns wait until the sample rate of their wheel has been checked against its clock."""

from collections.abc import Sequence

from tirebench.estimator.chain import Turn
from tirebench.estimator.wheels import Wheels


class CheckedTurns:
    """Turns on their way from the estimators to the screen, the page and the recording.

    A turn of a wheel whose rate is not judged yet is kept back. These are few, because a judgement
    takes `tirebench.wire.rate_check.JUDGED` frames, and `LONGEST_WAIT` at most. A turn of a wheel
    whose clock contradicts its rate is dropped.
    """

    def __init__(self) -> None:
        self._waiting: list[Turn] = []

    def take(self, turns: Sequence[Turn], wheels: Wheels, *, end: bool = False) -> list[Turn]:
        """Take new turns and return those that may be reported by now.

        Parameters
        ----------
        turns : sequence of Turn
        wheels : Wheels
            As they are now.
        end : bool
            Whether nothing more will be judged.

        Returns
        -------
        list of Turn
        """
        waiting = [*self._waiting, *turns]
        wrong, judged = wheels.contradicted, wheels.judged
        ready = [end or turn.wheel in judged for turn in waiting]
        self._waiting = [turn for turn, now in zip(waiting, ready, strict=True) if not now]
        return [t for t, now in zip(waiting, ready, strict=True) if now and t.wheel not in wrong]
