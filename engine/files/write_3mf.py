"""3MF out: one object of triangles, in text with 17 digits."""

from __future__ import annotations

import zipfile

import numpy as np

from engine.arrays import F64, I64
from engine.files.rows import formatted

_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<model unit="millimeter" xml:lang="en-US" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
    '<resources><object id="1" type="model"><mesh><vertices>\n'
)
_FOOT = '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>'


def write_3mf(name: str, v: F64, f: I64) -> None:
    """Write vertices (n, 3), in millimetres, and faces (f, 3) as the 3MF file `name`."""
    vertex = '<vertex x="%.17g" y="%.17g" z="%.17g"/>\n'
    triangle = '<triangle v1="%d" v2="%d" v3="%d"/>\n'
    with zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED, compresslevel=4) as archive:
        archive.writestr(_entry("[Content_Types].xml"), _TYPES)
        archive.writestr(_entry("_rels/.rels"), _RELATIONS)
        with archive.open(_entry("3D/3dmodel.model"), "w", force_zip64=True) as out:
            out.write(_HEAD.encode())
            for block in formatted(vertex, v):
                out.write(block)
            out.write(b"</vertices><triangles>\n")
            for block in formatted(triangle, np.asarray(f)):
                out.write(block)
            out.write(_FOOT.encode())


def _entry(name: str) -> zipfile.ZipInfo:
    # A fixed date: the same mesh gives the same bytes.
    entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry
