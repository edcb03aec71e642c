"""The command group, and the handling of errors: a message on stderr, status 2, no traceback."""

from __future__ import annotations

import gc
import io
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module

import click

import passgraph
from passgraph import interrupts
from passgraph.errors import InputError, PassgraphError, on_one_line

#: Environment variable that shows the traceback of unexpected errors.
TRACEBACK_VARIABLE = "PASSGRAPH_TRACEBACK"
#: Environment variable by which a shell asks for completions; click's name for this command.
COMPLETION_VARIABLE = "_PASSGRAPH_COMPLETE"
#: Threshold of the cyclic garbage collector; raised since the objects that a command loads contain no garbage.
GARBAGE_AFTER = 100_000
#: Environment variable of OpenBLAS, which numpy loads. Its threads spin after their start, on each core for as long as
#: numpy takes to import; 4 is for 2^4 cycles (OpenBLAS 0.3, driver/others/blas_server.c).
IDLE_THREADS = ("OPENBLAS_THREAD_TIMEOUT", "4")
#: Exit statuses of all commands.
STATUS = {
    0: "success; everything compared is within bounds and equal to its recording",
    1: "a comparison differs or is undecided, a case does not pass, or some frames failed",
    2: "an error; the message is on stderr",
    130: "interrupted (Ctrl-C)",
    141: "the reader closed the pipe (as in: passgraph backends | head -1); no message is printed",
    143: "terminated (SIGTERM)",
}
#: Commands by name, each with its help line; a command is imported lazily.
COMMANDS = {
    "render": "Render a scene with an effect to a picture.",
    "apply": "Apply an effect to pictures, sequences and videos.",
    "compare": "Compare every backend with the reference, pass by pass.",
    "conform": "Run the conformance suite on a backend.",
    "probe": "Measure what drivers do, beside specifications and known drivers.",
    "check": "Compare every backend with the reference on your own kernels.",
    "inspect": "Show the values of every line of a kernel at one pixel.",
    "backends": "List the available backends and devices.",
    "fuzz": "Test backends with random kernels, graphs and draws.",
    "bench": "Measure time against error, of shadow methods or your own graphs.",
    "plan": "Explain the plan of an effect: order, fusion and memory.",
    "export": "Export an effect to a page that runs in a browser.",
    "view": "Show an effect live in the browser, with sliders and hot reload.",
}


class _Commands(click.Group):
    """A group that lists commands without importing them, so that help is fast."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        found: click.Command = getattr(import_module(f"passgraph.commands.{cmd_name}"), cmd_name)
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from passgraph.arguments import near, shown

            ctx.fail(
                f"there is no command {shown(args[0])}{near(args[0], list(COMMANDS))}; there are {', '.join(COMMANDS)}"
            )
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))
        with formatter.section("Exit status"):
            formatter.write_dl([(str(number), meaning) for number, meaning in STATUS.items()])


@click.command(
    cls=_Commands, invoke_without_command=True, no_args_is_help=True, subcommand_metavar="COMMAND [ARGS]...",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)  # fmt: skip
@click.option("--version", "is_version", is_flag=True, help="Show the version and exit.")
@click.option(
    "--verbose", "is_verbose", is_flag=True,
    help="With --version: those of Python, libraries, devices and drivers too, for a report of an error.",
)  # fmt: skip
@click.pass_context
def group(context: click.Context, is_version: bool, is_verbose: bool) -> None:
    """Write a post-effect once, in Python; run it on OpenGL, OpenCL, WebGPU or the CPU.

    Know by how much they differ.
    """
    if is_version:
        click.echo(f"passgraph, version {passgraph.__version__}")
        if is_verbose:
            from passgraph.commands.backends import show_versions

            show_versions()
        context.exit()
    if is_verbose:
        raise click.UsageError("--verbose goes with --version: passgraph --version --verbose")
    if context.invoked_subcommand is None:
        raise click.UsageError("Missing command.")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit."""
    interrupts.install()
    os.environ.setdefault(*IDLE_THREADS)
    gc.set_threshold(GARBAGE_AFTER, *gc.get_threshold()[1:])
    try:
        status = run(None if arguments is None else list(arguments))
    except KeyboardInterrupt:  # before or after the command's own handling
        status = interrupts.status()
    sys.exit(status)


def run(arguments: list[str] | None) -> int:
    """Run a command; return its exit status, one of :data:`STATUS`, which the group's help lists too."""
    _open_streams()
    interrupts.raise_them(True)
    try:
        return _run(arguments)
    finally:
        interrupts.raise_them(False)
        if "passgraph.writing" in sys.modules:  # else no file was begun
            from passgraph.writing import discard_unfinished

            discard_unfinished()


def _run(arguments: list[str] | None) -> int:
    try:
        with warnings.catch_warnings():
            # Warnings of drivers and compilers are not errors; errors are raised.
            warnings.simplefilter("ignore")
            status = group.main(arguments, prog_name="passgraph", standalone_mode=False)
            sys.stdout.flush()
    except (KeyboardInterrupt, click.Abort) as error:
        where = error if str(error) else error.__cause__ or ""  # click replaces Python's error by its own
        what = "interrupted" if interrupts.status() == 130 else "terminated"
        click.echo(f"passgraph: {what} {where}".rstrip(), err=True)
        return interrupts.status()
    except BrokenPipeError:
        _drop_output()
        return 141
    except SystemExit as error:
        if COMPLETION_VARIABLE in os.environ and isinstance(error.code, int):  # click ends so after its suggestions
            return error.code
        # Of a broken pipe, click and rich make an exit, and see to it that Python reports nothing at its end.
        if isinstance(error.__context__, BrokenPipeError) or "PacifyFlushWrapper" in type(sys.stdout).__name__:
            return 141
        return failed(InputError(f"something that was run ended the process by sys.exit({error.code!r})"))
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return 2
    except Exception as error:
        if interrupts.received() is not None:  # an interrupt during the import of a C extension can raise another error
            return interrupts.status()
        if os.environ.get(TRACEBACK_VARIABLE):
            raise
        if isinstance(error, OSError) and not _can_print():
            _drop_output()
        return failed(error)
    return status if isinstance(status, int) else 0


def _open_streams() -> None:
    """Open the null device for a closed stdout or stderr, whose file number the next opened file would get.

    Characters that the output's encoding lacks (arrows in ASCII, file names that are not UTF-8) are escaped.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")


def _can_print() -> bool:
    try:
        sys.stdout.flush()
    except OSError:
        return False
    return True


def _drop_output() -> None:
    """Discard buffered output after a closed pipe or a full disk, since Python's flush at exit would fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def failed(error: Exception) -> int:
    """Print an error as one line, or with its lines if a caret points into a kernel."""
    if isinstance(error, click.ClickException):
        text = error.format_message()
        context = getattr(error, "ctx", None)
        if isinstance(error, click.UsageError) and context is not None:
            text += f" (see {context.command_path} --help)"
    elif isinstance(error, PassgraphError):
        text = str(error)
    elif isinstance(error, MemoryError):
        text = f"not enough memory ({str(error) or 'none left'}); use a smaller --size or picture"
    elif isinstance(error, OSError):
        text = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
    else:
        text = f"unforeseen {type(error).__name__}: {error}; set {TRACEBACK_VARIABLE}=1 to see where"
    click.echo(f"passgraph: error: {on_one_line(text)}", err=True)
    return 2
