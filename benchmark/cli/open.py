"""`simgap open`: a record and its diagnosis in the browser."""

from __future__ import annotations

import signal
import webbrowser
from contextlib import suppress
from typing import Annotated

import typer

from simgap.cli.options import Inputs, KindOf, Outputs, SamplingTime, parse_kinds
from simgap.records import UnusableInput


def open_page(
    data: Annotated[str, typer.Argument(metavar="[DATA]", help="Name of a data set, a folder or a file.")] = "",
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    kind: KindOf = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this machine; 0 for any that is free.")] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Print the address and open no browser.")] = False,
) -> None:
    """Show a record in the browser, diagnose it there and take the model away; nothing leaves this machine."""
    try:
        from simgap.app.server import Server
    except ImportError as error:
        if (error.name or "").partition(".")[0] not in ("starlette", "uvicorn"):
            raise
        raise UnusableInput(
            f"simgap open needs {error.name}, which is not installed: pip install 'simgap[app]'"
        ) from None
    from msgspec.structs import replace

    from simgap.app.reading import look, told

    said = None
    if data:
        seen = look(data)  # what cannot be read is refused here
        if inputs or outputs or dt is not None or kind:
            said = replace(told(seen, inputs or (), outputs or (), parse_kinds(kind or ())), dt=dt)
    try:
        server = Server(port, data, said)
    except OSError as error:
        raise UnusableInput(f"--port {port} cannot be used ({error.strerror}); leave it out for a free one") from None
    typer.echo(f"Open {server.address}\nCtrl-C ends it and deletes what was uploaded.")
    if not no_browser:
        webbrowser.open(server.address)
    if signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:  # a terminal that is closed ends it as Ctrl-C does
        signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))
    with suppress(KeyboardInterrupt):
        server.run()
    typer.echo("Ended, and deleted what was uploaded.")
