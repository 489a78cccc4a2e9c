"""Alarms: a value beyond its limit, until it is back by more than the hysteresis.

Limits stand in a file (``tirebench-alarms/1``); what it does not name keeps the limit of `RULES`::

    format = "tirebench-alarms/1"

    [loss]                 # % of the samples of the last seconds
    high = 2.0
    hysteresis = 1.0

    [tire_pressure]        # bar
    low = 2.1
    high = 2.6
    hysteresis = 0.05

    [silence]
    off = true             # no alarm
"""

import tomllib
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from tirebench.errors import DeviceError, cause

FORMAT = "tirebench-alarms/1"
ALARMS_KEPT = 50
"""Alarms that are remembered."""
LARGEST_LIMIT = 1e9


@dataclass(frozen=True, slots=True)
class Rule:
    """When a value is an alarm.

    Attributes
    ----------
    says, unit : str
        What the value is.
    low, high : float or None
        Beyond these it is one; None: there is no such limit.
    hysteresis : float
        So far must the value come back before the alarm ends.
    """

    says: str
    unit: str
    low: float | None = None
    high: float | None = None
    hysteresis: float = 0.0

    def beyond(self, value: float, *, already: bool) -> bool:
        """Whether a value is an alarm, given whether it is one already."""
        back = self.hysteresis if already else 0.0
        too_low = self.low is not None and value < self.low + back
        too_high = self.high is not None and value > self.high - back
        return too_low or too_high


RULES = {
    "silence": Rule("no sample for", "s", high=1.0, hysteresis=0.5),
    "rate": Rule("share of the expected samples received", "%", low=95.0, hysteresis=2.0),
    "loss": Rule("samples lost", "%", high=1.0, hysteresis=0.5),
    "saturated": Rule("samples saturated", "%", high=0.5, hysteresis=0.25),
    "invalid": Rule("turns invalid", "%", high=50.0, hysteresis=20.0),
    "delay": Rule("age of the newest sample", "ms", high=1000.0, hysteresis=500.0),
    "signal": Rule("signal", "dBm", low=-85.0, hysteresis=3.0),
    "temperature": Rule("transmitter's temperature", "degC", high=85.0, hysteresis=3.0),
    "battery": Rule("transmitter's battery", "V", low=3.2, hysteresis=0.05),
    "tire_pressure": Rule("tire pressure", "bar", hysteresis=0.05),
    "Fz": Rule("vertical load", "N", hysteresis=100.0),
    "alpha": Rule("slip angle", "deg", hysteresis=0.2),
    "kappa": Rule("slip ratio", "1", hysteresis=0.005),
    "Fy": Rule("lateral force", "N", hysteresis=100.0),
    "minutes_left": Rule("room for the recording", "min", low=10.0, hysteresis=1.0),
    "disk": Rule("free on the disk of the recording", "GB", low=1.0, hysteresis=0.1),
}
"""What is watched: the last two of the run, the others of each wheel. The limits are starting
points for whoever knows the rig; none of them was measured."""


def read_alarms(path: Path) -> dict[str, Rule]:
    """Return the limits of a file over those of `RULES`.

    Raises
    ------
    DeviceError
        With every fault of the file.
    """
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        said = str(error) if isinstance(error, tomllib.TOMLDecodeError) else cause(error)
        raise DeviceError(
            f"--alarms {path}: cannot be read ({said}); TOML in UTF-8 is needed; correct it"
        ) from None
    if document.pop("format", None) != FORMAT:
        raise DeviceError(
            f"--alarms {path}: the key format is not {FORMAT!r}; this program reads that format "
            "only; write it"
        )
    rules, faults = dict(RULES), []
    for name, table in document.items():
        if name not in RULES:
            faults.append(
                f"--alarms {path}: [{name}] is an unknown alarm; known alarms are "
                f"{', '.join(RULES)}; correct the spelling"
            )
            continue
        fault = _fault(name, table)
        if fault:
            faults.append(f"--alarms {path}: {fault}")
        elif table.get("off"):
            rules[name] = replace(RULES[name], low=None, high=None)
        else:
            rules[name] = replace(RULES[name], **{k: v for k, v in table.items() if k != "off"})
    if faults:
        raise DeviceError(faults)
    return rules


def _fault(name: str, table: Any) -> str:
    if not isinstance(table, dict):
        return f"{name} = {table!r}; a table [{name}] is needed; write it"
    if unknown := sorted(set(table) - {"low", "high", "hysteresis", "off"}):
        return (
            f"[{name}] has an unknown key, {', '.join(unknown)}; low, high, hysteresis and off are "
            "allowed; correct it"
        )
    for key, value in table.items():
        if key == "off":
            good = isinstance(value, bool)
        else:
            good = isinstance(value, int | float) and not isinstance(value, bool)
            good = good and abs(value) <= LARGEST_LIMIT and (key != "hysteresis" or value >= 0.0)
        if not good:
            return f"[{name}] {key} = {value!r}; a number is needed (off: true or false); write it"
    low, high = (table.get(key, getattr(RULES[name], key)) for key in ("low", "high"))
    back = table.get("hysteresis", RULES[name].hysteresis)
    if low is not None and high is not None and high - low <= 2.0 * back:
        return (
            f"[{name}] low = {low:g}, high = {high:g}, hysteresis = {back:g}: no value would end "
            "the alarm; more than twice the hysteresis must lie between the limits; widen them"
        )
    return ""


@dataclass(slots=True)
class Alarm:
    """One alarm.

    Attributes
    ----------
    name, text : str
        Name of the rule, and a sentence on what happened.
    wheel : int or None
        None: of the run.
    since : float, [s]
        On `time.time`.
    until : float or None, [s]
        When it ended; None while it goes on.
    value : float or None
        The newest one; None where the alarm has no limit.
    """

    name: str
    text: str
    wheel: int | None
    since: float
    value: float | None
    until: float | None = None


class Alarms:
    """Which alarms there are.

    Parameters
    ----------
    rules : mapping of name to Rule
    """

    def __init__(self, rules: Mapping[str, Rule] = RULES) -> None:
        self.rules = dict(rules)
        self._active: dict[tuple[str, int | None], Alarm] = {}
        self._past: deque[Alarm] = deque(maxlen=ALARMS_KEPT)

    def look(
        self, values: Mapping[str, float | None], wheel: int | None, now: float
    ) -> list[Alarm]:
        """Take values of a wheel, or of the run; return the alarms that begin or end with them.

        A value that is not known changes nothing.
        """
        changed = []
        for name, value in values.items():
            rule, key = self.rules[name], (name, wheel)
            alarm = self._active.get(key)
            if value is None:
                continue
            if rule.beyond(value, already=alarm is not None):
                if alarm is None:
                    alarm = Alarm(name, "", wheel, now, value)
                    self._active[key] = alarm
                    changed.append(alarm)
                alarm.value, alarm.text = value, _text(rule, value, wheel)
            elif alarm is not None:
                changed += self.end((name,), wheel, now)
        return changed

    def end(self, names: Iterable[str], wheel: int | None, now: float) -> list[Alarm]:
        """End those alarms of a wheel, or of the run, that go on; return them."""
        ended = [self._active.pop((name, wheel)) for name in names if (name, wheel) in self._active]
        for alarm in ended:
            alarm.until = now
        self._past.extend(ended)
        return ended

    def report(self, name: str, text: str, now: float) -> list[Alarm]:
        """Take what is wrong with the run, in words, empty if nothing is: an alarm without a limit.

        Return the alarm if it begins or ends with it.
        """
        if not text:
            return self.end((name,), None, now)
        alarm = self._active.get((name, None))
        if alarm is not None:
            alarm.text = text
            return []
        self._active[name, None] = alarm = Alarm(name, text, None, now, None)
        return [alarm]

    def document(self) -> dict[str, Any]:
        """Return what the page shows: alarms that go on, those that ended, and the limits."""
        return {
            "active": [asdict(alarm) for alarm in self._active.values()],
            "past": [asdict(alarm) for alarm in reversed(self._past)][:10],
            "limits": [{"name": name, **asdict(rule)} for name, rule in self.rules.items()],
        }


def _text(rule: Rule, value: float, wheel: int | None) -> str:
    low = rule.low is not None and value < rule.low + rule.hysteresis
    limit = rule.low if low else rule.high
    whose = "" if wheel is None else f"wheel {wheel}: "
    return f"{whose}{rule.says} {value:.4g} {rule.unit}, limit {limit:g} {rule.unit}"


def event_of(alarm: Alarm) -> dict[str, Any]:
    """Return an alarm as an event of the recording."""
    return {
        "event": "alarm",
        "state": "on" if alarm.until is None else "off",
        "name": alarm.name,
        "wheel": alarm.wheel,
        "value": alarm.value,
        "text": alarm.text,
    }
