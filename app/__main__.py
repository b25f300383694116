"""Command line: the window, and `replay`, `demo`, `sweep` and `batch` without one."""

from __future__ import annotations

import os

# Before numpy is imported: several BLAS threads slow the many small products of the solves down,
# stall the window, and change the last bits from one machine to another.
for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import argparse
import io
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

DEMOS = ("vase", "tank", "drill", "plate")
REFUSED = 2
FAILED = 3
INTERRUPTED = 130
LONGEST = 1000
"""Characters of a sentence that are printed: what a file was made to say may be longer."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code.

    0 done, 1 done in part, 2 refused, 3 a bug of ours, 130 interrupted.
    """
    _print_any_name()
    given = _parser().parse_args(_with_command(sys.argv[1:] if arguments is None else arguments))
    logging.basicConfig(
        level=logging.INFO if given.verbose else logging.WARNING,
        format="%(name)s: %(levelname)s: %(message)s",
    )
    from engine import EngineError

    try:
        return int(given.run(given))
    except EngineError as error:
        _say(str(error))
        return REFUSED
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read what is printed has gone; what is still to be flushed must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return REFUSED
    except MemoryError:
        _say("This needs more memory than there is. Use a mesh with fewer faces.")
        return REFUSED
    except Exception as error:
        logging.getLogger(__name__).info("the bug in full", exc_info=error)
        _say(
            f"Something went wrong in Eigenform itself ({type(error).__name__}: {error}). "
            "Please report it with what the same command says under --verbose."
        )
        return FAILED


def _say(sentence: str) -> None:
    """Print a sentence on one line of standard error, whatever names and numbers are in it."""
    from engine.files.report import shown

    text = shown(sentence)
    print(f"eigenform: {text[:LONGEST]}{'…' if len(text) > LONGEST else ''}", file=sys.stderr)


def _print_any_name() -> None:
    """Let a file name that the terminal's encoding does not know be printed with escapes."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def has_display() -> bool:
    """Return whether a window can be opened here."""
    if not sys.platform.startswith("linux"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _with_command(arguments: Sequence[str]) -> list[str]:
    """Put `window` before the arguments unless they name a command (or ask for help)."""
    words = list(arguments)
    first = next((word for word in words if not word.startswith("-")), None)
    if first in ("window", "replay", "demo", "sweep", "batch"):
        return words
    if first is None and {"-h", "--help", "--version"} & set(words):
        return words
    flags = [word for word in words if word in ("-v", "--verbose")]
    return [*flags, "window", *[word for word in words if word not in flags]]


def _parser() -> argparse.ArgumentParser:
    from importlib.metadata import PackageNotFoundError, version

    from app.batch.command import add_commands

    try:
        number = version("eigenform")
    except PackageNotFoundError:
        number = "not installed"
    parser = argparse.ArgumentParser(
        prog="eigenform",
        description="Reshape a form by sketching, at any level of its detail.",
        epilog="Without a command the window opens: eigenform [FILE].",
    )
    parser.add_argument("--version", action="version", version=f"eigenform {number}")
    parser.add_argument("-v", "--verbose", action="store_true", help="say what is being done")
    commands = parser.add_subparsers(title="commands", required=True)

    window = commands.add_parser("window", help="open the window (also without this word)")
    window.add_argument("file", type=Path, nargs="?", metavar="FILE", help="a mesh or .eigenform")
    window.set_defaults(run=_window)

    replay = commands.add_parser("replay", help="apply a recipe to a mesh file")
    replay.add_argument("recipe", type=Path, metavar="RECIPE")
    replay.add_argument("mesh", type=Path, metavar="IN")
    replay.add_argument("out", type=Path, metavar="OUT")
    replay.add_argument("--report", type=Path, metavar="FILE.json", help="write what was measured")
    replay.add_argument(
        "--force", action="store_true", help="replay on a mesh that the recipe was not made on"
    )
    replay.set_defaults(run=_replay)

    demo = commands.add_parser("demo", help="redo an example of the paper, with pictures")
    demo.add_argument("name", choices=DEMOS)
    demo.add_argument("--out", type=Path, required=True, metavar="DIR")
    demo.set_defaults(run=_demo)

    add_commands(commands)
    return parser


def _window(given: argparse.Namespace) -> int:
    if has_display():
        from app import start

        return start.main(given.file)
    if given.file is not None:
        from engine import EngineError

        raise EngineError(
            "There is no display to open a window on. Set DISPLAY, or use “eigenform replay”."
        )
    out = Path("pictures-out") / "vase"
    print("There is no display, so the vase is reshaped without a window.")
    return _make_demo("vase", out)


def _replay(given: argparse.Namespace) -> int:
    from app.headless import replay_file

    replay_file(given.recipe, given.mesh, given.out, given.report, given.force)
    return 0


def _demo(given: argparse.Namespace) -> int:
    return _make_demo(given.name, given.out)


def _make_demo(name: str, out: Path) -> int:
    from app.demo import demo

    for path in demo(name, out):
        print(path)
    print(f"The pictures are in {out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
