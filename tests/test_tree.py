"""What a frozen result becomes in a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ins_eval.calibration.labelings import Printed
from ins_eval.metrics import Estimate, Ratio
from ins_eval.tree import as_tree


@dataclass(frozen=True)
class Part:
    value: float
    asked: str | None
    found: float | None = None
    by_axis: Mapping[str, float] = field(default_factory=dict)
    format: str = "form/1"


def test_a_field_without_default_is_null_and_one_with_default_is_left_out_where_nothing_is_in_it():
    assert as_tree(Part(1.0, None)) == {"value": 1.0, "asked": None, "format": "form/1"}
    assert as_tree(Part(1.0, "x", 0.0, {"z": 2.0}))["found"] == 0.0


def test_numbers_are_plain_and_finite_at_any_depth():
    found = {"a": (Part(np.float64(np.nan), "x"), np.arange(3), np.array([1.0, np.inf])), "n": np.int64(4)}
    assert json.loads(json.dumps(as_tree(found), allow_nan=False)) == {
        "a": [{"value": None, "asked": "x", "format": "form/1"}, [0, 1, 2], [1.0, None]],
        "n": 4,
    }


def test_estimates_and_ratios_have_their_interval_and_other_named_tuples_their_fields():
    assert as_tree(Estimate(1.0, 0.5, 2.0)) == {"value": 1.0, "interval95": [0.5, 2.0]}
    assert as_tree(Estimate(1.0, np.nan, np.nan)) == {"value": 1.0, "interval95": None}
    assert as_tree([Ratio(0.8, 0.7, 0.9, 0.05)]) == [{"ratio": 0.8, "interval95": [0.7, 0.9]}]
    assert as_tree(Printed(1.0, 2.0, 3.0, 4.0))["eq14_bias"] == 4.0


def test_a_tree_stays_as_it_is():
    tree = {"a": [1, None, "x", {"b": 0.5}]}
    assert as_tree(tree) == tree
