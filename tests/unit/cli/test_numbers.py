"""What a verb says of a number that it cannot take, and how its help states limits."""

import click
import pytest
from click.testing import CliRunner

from tirelib.cli.common import Real, Whole


@click.command()
@click.option("--speed", type=Real())
@click.option("--share", type=Real(min=0.0, max=0.5, min_open=True))
@click.option("--count", type=Whole(1, 8))
@click.option("--least", type=Whole(min=1))
def verb(speed: float, share: float, count: int, least: int) -> None:
    """Print what came."""
    click.echo(f"{speed} {share} {count} {least}")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--speed", "80km/h"], "'80km/h' is given; a number is needed; write the number alone"),
        (["--speed", "0,5"], "'0,5' is given; a number is needed; write a decimal point"),
        (["--speed", "fast"], "'fast' is given; a number is needed\n"),
        (["--speed", "nan"], "'nan' is given; a finite number is needed"),
        (["--share", "0"], "'0' is given; a number, above 0 to 0.5, is needed"),
        (["--count", "9"], "'9' is given; a whole number, from 1 to 8, is needed"),
        (["--least", "2.5"], "'2.5' is given; a whole number, 1 or more, is needed"),
    ],
)
def test_what_is_given_what_is_needed_and_what_to_do(words: list[str], said: str) -> None:
    done = CliRunner().invoke(verb, words)
    assert done.exit_code == 2
    assert f"Invalid value for '{words[0]}': {said}" in done.stderr


def test_numbers_within_the_limits_come_through_and_help_states_them() -> None:
    words = ["--speed", "-1e3", "--share", "0.5", "--count", "8", "--least", "7"]
    assert CliRunner().invoke(verb, words).stdout == "-1000.0 0.5 8 7\n"
    text = CliRunner().invoke(verb, ["--help"]).stdout
    for part in ("[above 0 to 0.5]", "[from 1 to 8]", "[1 or more]"):
        assert part in text
    assert "RANGE" not in text
