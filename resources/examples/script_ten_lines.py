"""The whole edit from a script: give the belly of the vase another outline, keep its bumps.

python script_ten_lines.py picture.png
"""

import sys

import numpy as np
from PIL import Image

import engine
from app.pictures import Curve, Ink, Studio
from resources import features, sample_path

vase = engine.load(sample_path("vase"))
roi = np.flatnonzero(features("vase").region)  # vertex ids: here the right of the belly
parts = engine.decompose(vase, roi, modes=20)  # base shape, modes, details
shown = vase.vertices.copy()
shown[parts.roi] = parts.surface(4)  # the form without its bumps: 4 modes
view = engine.look_at(vase.bounds.mean(axis=0), 620, azimuth=0, elevation=4, size=(900, 900))

line = engine.closest_points(vase, np.linspace([42, 0, 136], [38, 0, 52], 200))
anchors = engine.anchor_path(vase, line.faces, view.project(line.points), view, parts.roi)
outline = view.project(shown[anchors])
drawn = outline + np.outer(np.sin(np.linspace(0, np.pi, len(outline))) ** 2, [40, 6])
target = engine.resample_target(shown[anchors], drawn, view)
edit = engine.SketchEdit(roi, parts.level_of(4), (engine.Stroke(anchors, view, target),))
edited = edit.apply(vase)

with Studio(vase) as studio:
    curve, ink = Curve(vase.vertices[anchors], "source"), Ink(target, "target")
    before = studio.picture(view, region=roi, curves=[curve], inks=[ink])
    after = studio.picture(view, edited.vertices)
both = Image.new("RGB", (1800, 900))
both.paste(before, (0, 0))
both.paste(after, (900, 0))
both.save(sys.argv[1])
