"""The program ``joulepath``: its commands, exit statuses and error messages.

    joulepath plan | matrix | compare-planners …  see service.cli.planning
    joulepath compare | diagnose | adopt … LOG    see service.cli.workbench
    joulepath logs join … | experiment …          see service.cli.logs
    joulepath maps | vehicles | effects | doctor  see service.cli.catalogues
    joulepath serve

``--json`` puts exactly one JSON document on stdout; everything else goes to stderr. Exit status: 0
done (a well-formed question whose answer is "no route" is done), 2 input that cannot be used, with
one sentence that says what would be, 1 anything else.

Heavy packages are imported inside the commands, so that listing maps does not wait for a compiler.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated

import typer
from pydantic import ValidationError

from planner.errors import Cancelled, InputError
from planner.validation import first_complaint
from service.cli import catalogues, logs, planning, workbench
from service.cli.terminal import Verbose

app = typer.Typer(
    name="joulepath",
    help="Lowest-energy routes on real terrain, with the energy accounted for by physical effect.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

VERBOSE = "--verbose"
# Typer turns an interrupt into this exit status.
_INTERRUPTED = 130


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"joulepath {version('joulepath')}")
        raise typer.Exit


@app.callback()
def _common(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port to listen on.")] = None,
    verbose: Verbose = False,
) -> None:
    """Serve HTTP and the page.

    Example: joulepath serve --port 8080
    """
    from service.compiling import compile_once, show_on_stderr
    from service.http import serve as run

    compile_once(show_on_stderr)
    run(host=host, port=port)


VERBS = (*planning.VERBS, *workbench.VERBS, *logs.VERBS, *catalogues.VERBS, serve)
for verb in VERBS:
    app.command()(verb)


def run(arguments: Sequence[str]) -> int:
    """Carry out a command line.

    Returns:
        the exit status; every failure was said on stderr.
    """
    try:
        status = app(list(arguments), prog_name="joulepath", standalone_mode=False)
        if status == _INTERRUPTED:
            raise KeyboardInterrupt
        return status if isinstance(status, int) else 0
    except typer.TyperException as error:
        if refused := _refused_option(error):
            _say(str(refused))
            return 2
        # A bare `joulepath` raises this with the help text that was already shown.
        if message := error.format_message():
            _say(message.rstrip(".") + "; see joulepath --help")
        return 2
    except InputError as error:
        _say(str(error))
        return 2
    except (Cancelled, KeyboardInterrupt, typer.Abort):
        _say("cancelled; nothing was written")
        return 1
    except BrokenPipeError:
        # The reader, such as `head`, is closed. Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if VERBOSE in arguments:
            raise
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        _say(f"unexpected failure: {what} (run again with {VERBOSE} for the traceback)")
        return 1


def _refused_option(error: typer.TyperException) -> InputError | None:
    """An option's value that is of the wrong kind or size, with the value; None for other errors.

    Typer's own sentence leaves the value out.
    """
    cause, option = error.__cause__, getattr(error, "param", None)
    if not isinstance(cause, ValidationError) or option is None:
        return None
    first = first_complaint(cause.errors(include_url=False))
    # "Input should be a valid integer, unable to parse …"
    accepted = first.message.removeprefix("Input should be ").partition(",")[0]
    return InputError(option.opts[0], "cannot be used", value=first.value, accepted=accepted)


def _say(sentence: str) -> None:
    print(f"joulepath: {sentence}", file=sys.stderr)  # noqa: T201


def main() -> None:
    """Entry point of the ``joulepath`` command."""
    status = 1
    try:
        status = run(sys.argv[1:])
    except Exception:
        import traceback

        traceback.print_exc()
    sys.exit(status)
