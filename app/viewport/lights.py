"""Key, fill and rim light, moving with the camera, and the clay they fall on."""

from __future__ import annotations

from typing import Any

from vtkmodules.vtkRenderingCore import vtkLight, vtkProperty, vtkRenderer

from app.look import Theme, rgb

#: Position in camera coordinates (x right, y up, z to the eye), colour, intensity.
KEY = ((-0.55, 0.80, 0.80), "#fff4e6", 0.80)
FILL = ((0.95, -0.05, 0.55), "#dbe6ff", 0.36)
RIM = ((0.55, 0.55, -0.85), "#ffffff", 0.60)


def light_up(renderer: vtkRenderer) -> None:
    """Replace the renderer's lights by key, fill and rim."""
    renderer.RemoveAllLights()
    renderer.SetAutomaticLightCreation(False)
    for place, colour, intensity in (KEY, FILL, RIM):
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*place)
        light.SetFocalPoint(0, 0, 0)
        light.SetColor(*rgb(colour))
        light.SetIntensity(intensity)
        renderer.AddLight(light)


def background(renderer: vtkRenderer, theme: Theme) -> None:
    """Lay the quiet vertical gradient of the theme; it is dithered, so it shows no bands.

    Ambient occlusion in VTK 9.7 fills the ground with one colour: then it is the mean of both.
    """
    ground: tuple[float, ...] = rgb(theme.ground)
    sky = rgb(theme.sky)
    if renderer.GetUseSSAO():
        ground = tuple((a + b) / 2 for a, b in zip(ground, sky, strict=True))
    renderer.SetBackground(*ground)
    renderer.SetBackground2(*sky)
    renderer.SetGradientBackground(True)
    renderer.SetDitherGradient(True)


def clay(prop: vtkProperty | Any) -> None:
    """Make a surface matt, with a broad soft highlight by which its form reads."""
    prop.SetInterpolationToPhong()
    prop.SetAmbient(0.20)
    prop.SetDiffuse(0.92)
    prop.SetSpecular(0.10)
    prop.SetSpecularPower(18)
    prop.SetSpecularColor(1.0, 0.98, 0.95)
