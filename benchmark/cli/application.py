"""All commands together, and what ends them: exit codes and one sentence instead of a traceback."""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

import simgap
from simgap.cli import (
    check,
    data,
    diagnose,
    export,
    fit,
    new_model,
    range_test,
    recovery,
    report,
    run,
    simulate,
    try_model,
    tune,
)
from simgap.cli import list as catalogue
from simgap.cli import next as next_command
from simgap.cli import open as opening
from simgap.records import UnusableInput

PLAIN = {
    "Input should be a valid number, unable to parse string as a number": "write a number with a point and without a "
    "unit, such as 0.01",
    "Input should be a valid integer, unable to parse string as an integer": "write a whole number",
    "Value error, ": "",
}

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
# In a list of commands a help of one line; that of the command itself says more.
COMMANDS = {
    "run": (run.run, "Fit models to data sets and score their free runs."),
    "report": (report.report, "Show stored results; write a leaderboard and a site."),
    "list": (catalogue.show, "List models, data sets, effects or suites."),
    "diagnose": (diagnose.diagnose, "Name what a simulation lacks, and measure the gain."),
    "open": (opening.open_page, "Diagnose a record in the browser."),
    "next": (next_command.next_record, "Design the record to take next."),
    "fit": (fit.fit, "Fit one model and say how well it simulates."),
    "simulate": (simulate.simulate, "Let a saved model run free over a record."),
    "export": (export.export, "Write a model for C, Python, FMI, ONNX and others."),
    "tune": (tune.tune, "Search the settings of a model."),
    "range-test": (range_test.range_test, "Show where a network's loss begins to fall."),
    "check": (check.check, "Compare results with a reference."),
    "new-model": (new_model.new_model, "Write a working model to change into your own."),
    "try-model": (try_model.try_model, "Say whether a model keeps its contract."),
}
for name, (command, says) in COMMANDS.items():
    app.command(name, short_help=says)(command)
app.add_typer(data.app, name="data")
app.add_typer(recovery.app, name="recovery")


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    """Classical and neural system identification on one bench, by free-run simulation."""
    if version:
        typer.echo(f"simgap {simgap.__version__}")
        raise typer.Exit()
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 done, 1 a job failed, 2 unusable input, 130 interrupted."""
    if arguments is None:
        # The system takes all memory back at once; looking for what could be freed first takes half a second.
        atexit.register(gc.freeze)
    try:
        code = app(args=arguments, prog_name="simgap", standalone_mode=False)
    except (UnusableInput, typer.TyperException) as error:
        return _refuse(
            _in_plain_words(error.format_message()) if isinstance(error, typer.TyperException) else str(error)
        )
    except OSError as error:
        return _refuse(f"{error.filename or 'a file'} cannot be read or written: {error.strerror or error}")
    except (KeyboardInterrupt, typer.Abort):
        return 130
    return code if isinstance(code, int) else 0


def _in_plain_words(message: str) -> str:
    """Say of a value that was refused how to write it; the parser speaks of types."""
    for said, instead in PLAIN.items():
        message = message.replace(said, instead)
    return message


def _refuse(sentence: str) -> int:
    print(f"simgap: {' '.join(sentence.split())}", file=sys.stderr)
    return 2
