"""Positions as tracks on a map: KML 2.2 (OGC 07-147r2) and GPX 1.1 (topografix.com)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pandas as pd

from ins_eval.errors import UsageError
from ins_eval.files import write_whole

KML, GPX = "http://www.opengis.net/kml/2.2", "http://www.topografix.com/GPX/1/1"
MOST_POINTS = 20_000  # of a track: what map programs draw without delay
COLOURS = ("ff000000", "ffb40000", "ff0070e0", "ff008000", "ff8000a0", "ff0000c0")  # aabbggrr
PLACE = ("latitude_deg", "longitude_deg", "height_m")
DEGREES = ".9f"  # 0.1 mm


def write_kml(frames: Mapping[str, pd.DataFrame], folder: Path) -> list[Path]:
    """``tracks.kml``: a line a solution or receiver, in at most `MOST_POINTS` points; heights above the ellipsoid."""
    Xml.register_namespace("", KML)
    root = Xml.Element(f"{{{KML}}}kml")
    document = Xml.SubElement(root, f"{{{KML}}}Document")
    tracks = _tracks(frames, "kml")
    styles = {name: f"track_{k}" for k, name in enumerate(tracks)}  # identifiers of XML, as names need not be
    for k, style_name in enumerate(styles.values()):
        style = Xml.SubElement(document, f"{{{KML}}}Style", id=style_name)
        line = Xml.SubElement(style, f"{{{KML}}}LineStyle")
        Xml.SubElement(line, f"{{{KML}}}color").text = COLOURS[k % len(COLOURS)]
        Xml.SubElement(line, f"{{{KML}}}width").text = "2"
    for name, place in tracks.items():
        mark = Xml.SubElement(document, f"{{{KML}}}Placemark")
        Xml.SubElement(mark, f"{{{KML}}}name").text = name.replace("_", " ")
        Xml.SubElement(mark, f"{{{KML}}}styleUrl").text = f"#{styles[name]}"
        line = Xml.SubElement(mark, f"{{{KML}}}LineString")
        Xml.SubElement(line, f"{{{KML}}}altitudeMode").text = "absolute"
        Xml.SubElement(line, f"{{{KML}}}coordinates").text = " ".join(
            f"{longitude:{DEGREES}},{latitude:{DEGREES}}" + (f",{height:.3f}" if np.isfinite(height) else "")
            for latitude, longitude, height in place
        )
    return [_written(root, folder / "tracks.kml")]


def write_gpx(frames: Mapping[str, pd.DataFrame], folder: Path) -> list[Path]:
    """``tracks.gpx``: a track a solution or receiver. Points have no time, since a recording has no date."""
    Xml.register_namespace("", GPX)
    root = Xml.Element(f"{{{GPX}}}gpx", version="1.1", creator="ins_eval")
    for name, place in _tracks(frames, "gpx").items():
        track = Xml.SubElement(root, f"{{{GPX}}}trk")
        Xml.SubElement(track, f"{{{GPX}}}name").text = name.replace("_", " ")
        segment = Xml.SubElement(track, f"{{{GPX}}}trkseg")
        for latitude, longitude, height in place:
            at = {"lat": f"{latitude:{DEGREES}}", "lon": f"{longitude:{DEGREES}}"}
            point = Xml.SubElement(segment, f"{{{GPX}}}trkpt", at)
            if np.isfinite(height):
                Xml.SubElement(point, f"{{{GPX}}}ele").text = f"{height:.3f}"
    return [_written(root, folder / "tracks.gpx")]


def _tracks(frames: Mapping[str, pd.DataFrame], form: str) -> dict[str, np.ndarray]:
    """Latitude, longitude in degrees, height in m (m, 3) of every table that has them; longitudes within ±180."""
    found = {}
    for name, frame in frames.items():
        if not set(PLACE) <= set(frame):
            continue
        rows = frame[frame.valid] if "valid" in frame else frame
        place = rows[list(PLACE)].to_numpy(dtype=float)
        place = place[np.isfinite(place[:, :2]).all(axis=1)]
        if len(place):
            step = -(-len(place) // MOST_POINTS)
            place = np.vstack([place[:-1:step], place[-1:]])
            place[:, 1] = (place[:, 1] + 180.0) % 360.0 - 180.0
            found[name] = place
    if not found:
        raise UsageError(f"export {form}: the result holds no positions; choose csv, parquet, mat, nc or tex")
    return found


def _written(root: Xml.Element, path: Path) -> Path:
    return write_whole(path, Xml.tostring(root, encoding="utf-8", xml_declaration=True))
