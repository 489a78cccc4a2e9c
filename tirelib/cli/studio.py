"""``tirelib studio``: the journey in the browser."""

import os
import webbrowser
from pathlib import Path
from typing import Any

import click

from tirelib.cli.common import Whole
from tirelib.cli.options import Decorator
from tirelib.core.errors import ParameterError

_EXAMPLE = """\b
Examples:
  tirelib studio
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib studio straight
  tirelib studio straight --port 8765 --no-browser

\b
The page opens a campaign, shows where the base model fails, names the effect that is missing, adds
it, and shows how the error falls. It is served on this machine only; the address holds a token,
without which nothing is shown. Everything is kept in the session folder, so the page can be closed
at any time. Ctrl+C ends the server. Exit code: 0 done, 2 bad input.
"""
LOOPBACK = "127.0.0.1"


def _session() -> Decorator:
    return click.option(
        "--session",
        "session_folder",
        metavar="FOLDER",
        type=click.Path(path_type=Path, file_okay=False),
        help="Folder that keeps campaigns, models and jobs. [default: tirelib-studio in the user's "
        "folder for state]",
    )


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="[CAMPAIGN]", required=False, type=click.Path(path_type=Path))
@click.option(
    "--model",
    "model_file",
    metavar="M.toml",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Begin with this model of CAMPAIGN instead of fitting one.",
)
@_session()
@click.option(
    "--root",
    "roots",
    metavar="FOLDER",
    multiple=True,
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder in which campaigns may be chosen on the page; may be given several times. "
    "[default: the present folder and the user's home]",
)
@click.option("--port", type=Whole(0, 65535), default=0, help="Port; 0 takes a free one.")
@click.option("--no-browser", is_flag=True, help="Print the address, and open no browser.")
def studio(
    folder: Path | None,
    model_file: Path | None,
    session_folder: Path | None,
    roots: tuple[Path, ...],
    port: int,
    no_browser: bool,
) -> None:
    """See in the browser where a model fails, add the effect that is missing, take it away."""
    import starlette  # noqa: F401 - what the extra brings is named before anything is written
    import uvicorn  # noqa: F401
    import websockets  # noqa: F401

    from tirelib.studio.desk import Desk
    from tirelib.studio.disk import hold
    from tirelib.studio.jobs import Jobs
    from tirelib.studio.server import Studio, serve
    from tirelib.studio.session import Session
    from tirelib.web.address import new_token

    if model_file is not None and folder is None:
        raise ParameterError("--model needs CAMPAIGN; give the campaign that it was made from")
    place = (session_folder or _default()).expanduser().resolve()
    with hold(place):
        session = Session(place)
        desk = Desk(session, Jobs(place / "jobs"), roots or (Path.cwd(), Path.home()))
        first = desk.start(folder, model_file) if folder is not None else ""
        known = session.address
        opened = _bound(port, int(known.get("port", 0)))
        token, at = str(known.get("token") or new_token()), opened.getsockname()[1]
        session.keep_address(at, token)
        url = f"http://{LOOPBACK}:{at}/?token={token}"
        click.echo(f"studio: {url}")
        click.echo(f"session: {place}")
        if not no_browser:
            webbrowser.open(url)
        serve(Studio(desk, token, LOOPBACK, at, first), opened)


def _bound(port: int, last: int) -> Any:
    """Bind the port that was asked for, else the last one, else a free one."""
    from tirelib.web.address import listener

    for wanted in (port,) if port else (last, 0):
        try:
            return listener(LOOPBACK, wanted)
        except OSError as error:
            if wanted == 0 or port:
                raise ParameterError(
                    f"--port {wanted}: it cannot be bound ({error.strerror}); choose another, or 0 "
                    "for any free one"
                ) from None
    raise AssertionError("a free port is always tried")


def _default() -> Path:
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "tirelib-studio"
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "tirelib-studio"
