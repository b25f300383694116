"""Takes the pictures of the README and the guide: `python -m tests.pictures` (`make pictures`).

Each look runs in a process of its own, for scale and theme are chosen before the first window is
made. The pictures that the pages show (scale 1, light) go to resources/pictures, made smaller; all
others, for people to look at, to pictures-out.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path

from tests.pictures.scenes import SCENES

ROOT = Path(__file__).resolve().parents[2]
SHOWN = ROOT / "resources" / "pictures"
LOOKED_AT = ROOT / "pictures-out" / "window"
SIZE = (1180, 800)
WIDTH = 1180
FIGURES = {"vase": 12, "drill": 14}


def main() -> int:
    """Take the pictures asked for; return 1 if a scene failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.pictures", description=__doc__)
    parser.add_argument("scenes", nargs="*", help=f"of {', '.join(SCENES)}; all without")
    parser.add_argument("--all", action="store_true", help="also dark, and at twice the size")
    parser.add_argument("--one", nargs=2, metavar=("THEME", "FOLDER"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    scenes = given.scenes or list(SCENES)
    if given.one:
        failed = [scene for scene in scenes if take(scene, given.one[0], Path(given.one[1]))]
        if failed:
            print("failed:", ", ".join(failed), file=sys.stderr)
        return 1 if failed else 0
    looks = [("light", "1")]
    if given.all:
        looks += [("dark", "1"), ("light", "2"), ("dark", "2")]
    failures = 0
    for theme, scale in looks:
        folder = SHOWN if (theme, scale) == looks[0] else LOOKED_AT / f"{theme}-{scale}x"
        folder.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-m", "tests.pictures", *scenes, "--one", theme, str(folder)]
        environment = {**os.environ, "QT_SCALE_FACTOR": scale}
        failures += subprocess.run(command, env=environment, cwd=ROOT, check=False).returncode
    if not given.scenes:
        figures()
    return 1 if failures else 0


def take(scene: str, theme: str, folder: Path) -> int:
    """Run one scene in this process; return 1 if it failed or kept other pictures than it tells."""
    from PySide6.QtCore import QSettings

    with tempfile.TemporaryDirectory() as place:
        QSettings.setDefaultFormat(QSettings.Format.IniFormat)
        QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, place)
        # Somebody's own folder, with nothing of this machine in it.
        os.environ["HOME"] = place
        for name in ("XDG_STATE_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME"):
            os.environ.pop(name, None)
        from app.look import Appearance
        from app.start import application
        from app.window import Window
        from tests.pictures.studio import Stage

        window = Window(Appearance(application(), theme))
        window.resize(*SIZE)
        window.show()
        window.move(0, 0)
        window.activateWindow()
        stage = Stage(window, folder, shrink if folder == SHOWN else None)
        stage.wait(0.5)
        started = time.monotonic()
        try:
            SCENES[scene].take(stage)
        except Exception:  # noqa: BLE001 (the other scenes are taken all the same)
            traceback.print_exc()
        missing = set(SCENES[scene].pictures) ^ set(stage.kept)
        window.close()
        stage.wait(0.3)
        print(f"{scene}: {len(stage.kept)} pictures in {time.monotonic() - started:.0f} s")
    if missing:
        print(f"{scene} says otherwise about {', '.join(sorted(missing))}", file=sys.stderr)
    return 1 if missing else 0


def figures() -> None:
    """Redo those of the paper's figures whose sheets the README shows."""
    from app.demo import demo

    for name, figure in FIGURES.items():
        folder = ROOT / "pictures-out" / name
        for _ in demo(name, folder):
            pass
        sheet = SHOWN / f"figure-{figure}.png"
        SHOWN.mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / sheet.name, sheet)
        shrink(sheet)


def shrink(path: Path) -> None:
    """Replace a picture by one small enough to be kept with the source."""
    from PIL import Image

    with Image.open(path) as picture:
        small = picture.convert("RGB")
    small.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
    small.save(path.with_suffix(".jpg"), quality=86, optimize=True, subsampling=0)
    path.unlink()


if __name__ == "__main__":
    sys.exit(main())
