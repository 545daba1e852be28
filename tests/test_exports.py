"""Results that leave: every format read back by other software, with equal numbers."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import gpxpy
import numpy as np
import pandas as pd
import pytest
import scipy.io
from lxml import etree

import ins_eval as ie
from ins_eval.errors import UsageError
from ins_eval.exports import FORMATS
from ins_eval.exports.arrays import write_mat, write_netcdf
from ins_eval.exports.frames import plain
from ins_eval.exports.tables import write_csv, write_latex, write_parquet
from ins_eval.exports.tracks import MOST_POINTS
from ins_eval.options import EXPORTS

KML = {"kml": "http://www.opengis.net/kml/2.2"}
# that of tracks; the whole schema of the OGC, ogckml22.xsd with what it imports, takes its place where it is named
KML_SCHEMA = Path(os.environ.get("KML_SCHEMA") or Path(__file__).with_name("kml.xsd"))
PLACE_DEG, HEIGHT_M = 5.1e-10, 5.1e-4  # half of the last digit that a track states


@pytest.fixture(scope="module")
def flight():
    return ie.simulate("straight", rate_hz=10.0)


@pytest.fixture(scope="module")
def result(flight):
    return ie.evaluate(flight.recording, ["believed"])


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("exported")
    written = result.export(folder, *FORMATS)
    assert set(folder.iterdir()) == set(written)
    return folder


def same(found: np.ndarray, expected: pd.Series) -> bool:
    return np.array_equal(np.asarray(found, dtype=float), expected.to_numpy(dtype=float), equal_nan=True)


def test_the_tables_are_solution_errors_and_figures(result) -> None:
    tables = result.frames
    assert {"figures", "solution_believed", "errors_believed", "gps"} <= set(tables)
    errors = tables["errors_believed"]
    rms = np.sqrt(np.mean(errors.velocity_north_mps[errors.valid] ** 2))
    assert rms == pytest.approx(result.to_frame().loc["believed", "velocity_rms_north_mps"], rel=1e-12)


def test_csv_and_parquet_hold_every_digit(result, folder: Path) -> None:
    for name, table in result.frames.items():
        for read in (pd.read_csv(folder / f"{name}.csv"), pd.read_parquet(folder / f"{name}.parquet")):
            assert list(read) == list(table)
            numbers = table.select_dtypes("number")
            assert all(same(read[column], numbers[column]) for column in numbers)


def test_mat_and_netcdf_hold_every_digit(result, folder: Path) -> None:
    mat = scipy.io.loadmat(folder / "result.mat", squeeze_me=True, simplify_cells=True)
    with scipy.io.netcdf_file(folder / "result.nc", mmap=False) as netcdf:
        variables = {name: variable.data.copy() for name, variable in netcdf.variables.items()}
    for name, table in result.frames.items():
        for column in table.select_dtypes("number"):
            assert same(np.atleast_1d(mat[name][column]), table[column])
            assert same(variables[f"{name}_{column}"], table[column])
    assert str(mat["figures"]["compensation"]) == "believed"
    assert b"".join(variables["figures_compensation"].ravel()) == b"believed"


def test_a_track_is_where_the_solution_is(result, folder: Path) -> None:
    """KML as OGC 07-147r2 has it: longitude, latitude, height; GPX by a library that knows nothing of us."""
    root = ElementTree.parse(folder / "tracks.kml").getroot()
    assert root.tag == f"{{{KML['kml']}}}kml"
    marks = root.findall("kml:Document/kml:Placemark", KML)
    styles = {f"#{style.get('id')}" for style in root.findall("kml:Document/kml:Style", KML)}
    assert {mark.findtext("kml:styleUrl", "", KML) for mark in marks} == styles
    lines = {
        mark.findtext("kml:name", "", KML): mark.findtext("kml:LineString/kml:coordinates", "", KML) for mark in marks
    }
    gpx = gpxpy.parse((folder / "tracks.gpx").read_text())
    tracks = {track.name: track.segments[0].points for track in gpx.tracks}
    assert set(lines) == set(tracks) >= {"solution believed", "gps"}
    solution = result.frames["solution_believed"][["latitude_deg", "longitude_deg", "height_m"]].to_numpy()
    step = -(-len(solution) // MOST_POINTS)
    expected = np.vstack([solution[:-1:step], solution[-1:]])
    ours = np.array([[float(part) for part in point.split(",")] for point in lines["solution believed"].split()])
    theirs = np.array([(p.latitude, p.longitude, p.elevation) for p in tracks["solution believed"]])
    for found in (ours[:, [1, 0, 2]], theirs):
        assert np.abs(found[:, :2] - expected[:, :2]).max() <= PLACE_DEG
        assert np.abs(found[:, 2] - expected[:, 2]).max() <= HEIGHT_M


@pytest.fixture(scope="module")
def schema() -> etree.XMLSchema:
    return etree.XMLSchema(etree.parse(KML_SCHEMA))


def test_kml_keeps_to_its_schema(schema: etree.XMLSchema, folder: Path, tmp_path: Path) -> None:
    schema.assertValid(etree.parse(folder / "tracks.kml"))
    place = pd.DataFrame({"latitude_deg": [45.0, 45.1], "longitude_deg": [7.0, -7.0], "height_m": [np.nan, 1.0]})
    (odd,) = FORMATS["kml"]({"2nd run: a/b <c>": place, "2nd run: a b (c)": place}, tmp_path)
    schema.assertValid(etree.parse(odd))


@pytest.mark.parametrize("spoiled", ["order", "identifier", "color"])
def test_the_schema_refuses_what_is_no_kml(spoiled: str, schema: etree.XMLSchema, folder: Path) -> None:
    tree = etree.parse(folder / "tracks.kml")
    if spoiled == "order":
        mark = tree.find("kml:Document/kml:Placemark", KML)
        mark.insert(1, mark.find("kml:LineString", KML))
    elif spoiled == "identifier":
        tree.find("kml:Document/kml:Style", KML).set("id", "2nd run")
    else:
        tree.find(".//kml:color", KML).text = "blue"
    assert not schema.validate(tree)


def test_latex_holds_the_main_figures(result, folder: Path) -> None:
    text = (folder / "figures.tex").read_text()
    assert text.startswith("\\begin{tabular}") and "\\toprule" in text
    value = result.to_frame().loc["believed", "velocity_rms_horizontal_mps"]
    assert f"{value:.4f}" in text and "velocity\\_rms\\_horizontal\\_mps" in text


def test_what_is_nested_in_a_table_gets_columns_of_its_own(tmp_path: Path) -> None:
    effect = {"name": "creep", "parameters": {"value": 4.8, "interval95": [4.5, 5.1]}, "of": ["a", "b"]}
    flat = {"parameters_value": 4.8, "parameters_interval95_low": 4.5, "parameters_interval95_high": 5.1}
    assert plain(pd.DataFrame([effect])).to_dict("records") == [{"name": "creep", **flat, "of": "a, b"}]
    empty = {"figures": plain(pd.DataFrame())}
    for write in (write_csv, write_parquet, write_mat, write_netcdf, write_latex):
        assert write(empty, tmp_path)


def test_formats_are_those_of_the_option_and_others_are_refused(result, tmp_path: Path) -> None:
    assert tuple(FORMATS) == EXPORTS
    with pytest.raises(UsageError, match="no format 'kmz'; did you mean 'kml'"):
        result.export(tmp_path, "kmz")
    with pytest.raises(UsageError, match="holds no positions"):
        FORMATS["gpx"]({"figures": pd.DataFrame({"a": [1.0]})}, tmp_path)


def test_residuals_of_a_comparison_have_the_rms_that_is_reported(flight) -> None:
    found = ie.compare(replace(flight.recording, reference=flight.truth))
    residuals = found.frames["residuals"]
    reported = found.to_frame()
    for channel, unit in (("gyro_x", "radps"), ("accelerometer_z", "mps2")):
        rms = np.sqrt(np.mean(residuals[f"{channel}_after_fit_{unit}"] ** 2))
        assert rms == pytest.approx(reported.loc[channel, "rms_after_fit"], rel=1e-9)
