"""docs/formats.md names every format, every key that its reader lets a user assume, and every key of the mapping."""

from __future__ import annotations

import re

from ins_eval.readers import FORMATS, autopilot, dataflash, fix_columns, mapped, novatel, rosbag
from ins_eval.readers.assembly import PLACE
from ins_eval.readers.layout import Layout
from ins_eval.readers.mapping import Epochs, MappingFile
from tests.test_docs import named, once, rows

PAGE = "formats.md"
COMMON = {*Layout.KEYS, "kind", "time.unit", "gps.time_offset_s", "reference.time_offset_s", "position.unit"}


def test_every_format_stands_in_the_page_and_no_other():
    assert once([named(row["format"])[0] for row in rows(PAGE, "format")]) == set(FORMATS)


def test_every_key_that_may_be_assumed_stands_in_the_page():
    page = once([key for row in rows(PAGE, "key", "What may be assumed") for key in named(row["key"])])
    readers = (autopilot, dataflash, fix_columns, mapped, novatel, rosbag)
    assert page == {key for reader in readers for key in reader.KEYS} - COMMON
    assert set(PLACE) <= page


def test_every_key_of_the_mapping_stands_in_the_page():
    assert once([named(row["key"])[0] for row in rows(PAGE, "key", "The mapping")]) == set(MappingFile.model_fields)
    page = [named(row["key of a navigator"])[0] for row in rows(PAGE, "key of a navigator")]
    assert once(page) == set(Epochs.model_fields)


def test_axes_and_forms_are_those_of_the_mapping():
    stated = {named(row["key of a navigator"])[0]: row["value"] for row in rows(PAGE, "key of a navigator")}
    for group in ("position", "velocity", "attitude"):
        model = next(one for one in Epochs.model_fields[group].annotation.__args__ if one is not type(None))
        for field in model.model_fields.values():
            for choice in re.findall(r"'([^']+)'", str(field.annotation) if "Literal" in str(field.annotation) else ""):
                assert choice in stated[group] or choice in ("geodetic", "roll pitch heading"), choice
