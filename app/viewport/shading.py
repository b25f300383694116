"""Ways to look at a form: zebra and reflection lines per pixel, curvature and deviation as maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.look import rgb8
from app.viewport.overlay import Legend
from engine import Mesh, cotangent_stiffness, vertex_areas
from engine.arrays import F64
from engine.figures import figure

STEPS = (1, 1.5, 2, 3, 4, 5, 6, 8, 10)  # ends of a scale, times a power of ten
Display = Literal["clay", "zebra", "reflection", "curvature", "deviation"]
Way = Literal["horizontal", "vertical", "diagonal"]
FEWEST, MOST = 4, 60  # stripes
_ACROSS = {"vertical": (1.0, 0.0, 0.0), "diagonal": (0.5**0.5, 0.5**0.5, 0.0)}

#: From far inside over nothing to far outside: blue and orange stay apart for everybody.
DIVERGING = ("#1f4e9c", "#5b93cf", "#b9d3e8", "#f3f1ec", "#f3c59a", "#e08a45", "#a8441c")

_LIGHT = "//VTK::Light::Impl"
# VTK turns the normal of a triangle round that is seen from its back. Of a form with fewer faces
# some triangles of an even surface are turned over: those it would light from behind, dark specks.
# Only where the normal turns away from the eye as well it is the inside that one sees.
_OUTSIDE = """
  vec3 sightRay = cameraParallel == 1 ? vec3(0.0, 0.0, -1.0) : normalize(vertexVC.xyz);
  if (gl_FrontFacing == false && dot(normalVCVSOutput, sightRay) > 0.0)
    normalVCVSOutput = -normalVCVSOutput;
"""

# Stripes on the sphere of reflected directions, upright with the form's up axis. `fwidth` gives the
# stripe's width on screen, so that its edge is smooth at any distance.
_REFLECTED = """//VTK::Light::Impl
  vec3 stripeEye = cameraParallel == 1 ? vec3(0.0, 0.0, -1.0) : normalize(vertexVC.xyz);
  vec3 stripeRay = reflect(stripeEye, normalVCVSOutput);
  float stripeHigh = asin(clamp(dot(stripeRay, stripeAxis), -0.999, 0.999));
  float stripeAt = stripeHigh * stripeCount / 3.14159265;
  float stripeWide = max(fwidth(stripeAt), 1e-5);
  float stripeOff = abs(fract(stripeAt) - 0.5);
"""
_ZEBRA = (
    _REFLECTED
    + """
  float stripe = smoothstep(0.25 - stripeWide, 0.25 + stripeWide, stripeOff);
  stripe = mix(stripe, 0.5, clamp(2.0 * stripeWide - 0.6, 0.0, 1.0));
  float stripeLit = 0.72 + 0.28 * abs(normalVCVSOutput.z);
  gl_FragData[0] = vec4(mix(vec3(0.07, 0.07, 0.08), vec3(0.96, 0.95, 0.93), stripe) * stripeLit,
      gl_FragData[0].a);
"""
)
_REFLECTION = (
    _REFLECTED
    + """
  float stripeLine = 1.0 - smoothstep(0.05, 0.05 + 1.5 * stripeWide, stripeOff);
  stripeLine *= 1.0 - clamp(2.0 * stripeWide - 0.4, 0.0, 1.0);
  gl_FragData[0] = vec4(mix(gl_FragData[0].rgb, vec3(0.06, 0.06, 0.09), 0.85 * stripeLine),
      gl_FragData[0].a);
"""
)
_STRIPES = {"zebra": (_ZEBRA, 1.0), "reflection": (_REFLECTION, 1.5)}  # lines want to be more


@dataclass(frozen=True)
class Stripes:
    """The stripes of light that a form reflects.

    Parameters
    ----------
    count : of them from below to above; of the finer lines half as many again.
    way : "horizontal" ones stay level while the form turns; the others stay with who looks.
    """

    count: int = 14
    way: Way = "horizontal"

    def axis(self, up: F64) -> F64:
        """Return the unit direction across them, (3,) in camera coordinates.

        Parameters
        ----------
        up : the form's up axis in camera coordinates, (3,).
        """
        return up if self.way == "horizontal" else np.array(_ACROSS[self.way])


def set_stripes(shader: Any, display: Display, stripes: Stripes) -> None:
    """Let a vtkShaderProperty draw what `display` needs of stripes, or none."""
    shader.ClearAllFragmentShaderReplacements()
    code, times = _STRIPES.get(display, (_LIGHT, 0.0))
    shader.AddFragmentShaderReplacement(_LIGHT, True, _OUTSIDE + code, False)
    if display in _STRIPES:
        uniforms = shader.GetFragmentCustomUniforms()
        uniforms.SetUniformf("stripeCount", float(round(times * stripes.count)))


def turn_stripes(shader: Any, stripes: Stripes, up: F64) -> None:
    """Let the stripes lie as they shall; `up` is the form's up in camera coordinates, (3,)."""
    axis = [float(c) for c in stripes.axis(up)]
    shader.GetFragmentCustomUniforms().SetUniform3f("stripeAxis", axis)


def signed_mean_curvature(mesh: Mesh) -> F64:
    """Return H at each vertex, (n,), in 1 / mesh unit: positive on ridges, negative in grooves.

    H = n . (M^-1 K x) / 2 with n the outward normal.
    """
    m = vertex_areas(mesh)
    turned = ((cotangent_stiffness(mesh) @ mesh.vertices) * mesh.vertex_normals).sum(axis=1)
    curvature: F64 = np.divide(turned, 2 * m, out=np.zeros_like(m), where=m > 0)
    curvature[mesh.topology.border_vertices] = 0.0
    return curvature


def signed_deviation(positions: F64, reference: F64, normals: NDArray[Any]) -> F64:
    """Return the distance of each vertex from where it was, (n,): positive outwards.

    Parameters
    ----------
    positions, reference : (n, 3).
    normals : (n, 3) of either surface; only their side counts.
    """
    moved = positions - reference
    side = np.where((moved * normals).sum(axis=1) < 0, -1.0, 1.0)
    return np.asarray(side * np.linalg.norm(moved, axis=1))


def _scale() -> NDArray[np.uint8]:
    """Return the colours (c, 3) from one end of a map to the other, finer than eight bits show."""
    stops = np.array([rgb8(c) for c in DIVERGING], dtype=np.float64)
    at = np.linspace(0, len(stops) - 1, 4097)
    columns = [np.interp(at, np.arange(len(stops)), stops[:, k]) + 0.5 for k in range(3)]
    return np.stack(columns, axis=1).astype(np.uint8)


_SCALE = _scale()


def mapped(values: ArrayLike, most: float) -> NDArray[np.uint8]:
    """Return colours (n, 3) of values in -most..most."""
    half = len(_SCALE) // 2
    place = np.asarray(values, dtype=np.float64) * (half / most) + (half + 0.5)
    return np.asarray(_SCALE[np.clip(place, 0, 2 * half).astype(np.int64)])


def round_up(value: float) -> float:
    """Return the next end of a scale that one can read, at most half as much again as `value`."""
    if not value > 0:
        return 1e-3
    power = 10.0 ** np.floor(np.log10(value))
    step = next(step for step in STEPS if step * power >= value * (1 - 1e-9))
    return float(f"{step * power:.3g}")  # 3 * 0.1 is not 0.3


def legend(title: str, most: float) -> Legend:
    """Return the scale of a map over -most..most."""
    return Legend(title, DIVERGING, f"−{figure(most)}", "0", f"+{figure(most)}")
