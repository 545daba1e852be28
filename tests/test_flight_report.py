"""The numbers of a flight report: those promised are there, finite, and follow from the members."""

from __future__ import annotations

import hashlib
import json
import re
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ins_eval import metrics
from ins_eval.ensemble import ARMS, SOURCES, Store
from tests.test_docs import missing_figures

FLOOR_M = 1e-3  # horizontal, zero sensor error, 100 Hz: the floor that is promised
DAY_S = 86400.0
DEFINITIONS = ("final", "rms_08326", "elliptical", "least_squares", "radial_error_rate_rms", "trms")
AXES = ("north", "east", "down", "horizontal")


def parsed(path: Path) -> dict[str, Any]:
    """JSON without the numbers that JSON does not know."""

    def refuse(text: str) -> None:
        raise AssertionError(f"{path.name} holds {text}")

    return json.loads(path.read_text(), parse_constant=refuse)


@pytest.fixture(scope="module")
def numbers(small_report: Path) -> dict[str, Any]:
    return parsed(small_report / "metrics.json")


@pytest.fixture(scope="module")
def manifest(small_report: Path) -> dict[str, Any]:
    return parsed(small_report / "manifest.json")


@pytest.fixture(scope="module")
def flown(small_report: Path, manifest: dict[str, Any]) -> dict[str, dict[str, np.ndarray]]:
    """What the members contribute, stacked here."""
    store = Store(small_report / "members" / manifest["key"])
    members = [store.read(i) for i in range(manifest["sizes"]["all"])]
    return {arm: {key: np.array([m[arm][key] for m in members]) for key in members[0][arm]} for arm in members[0]}


def walk(tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every table, list and leaf of a tree with its path."""
    yield path, tree
    inside = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in inside:
        yield from walk(value, f"{path}.{key}")


def test_promised_keys_are_there(numbers: dict[str, Any]) -> None:
    of_all = numbers["ensemble"]
    assert of_all["size"] == 4
    for arm in ARMS:
        assert set(of_all[arm]["velocity_rms_mps"]) >= set(AXES)
        assert set(of_all[arm]["cep_rate_nmi_per_h"]) >= set(DEFINITIONS)
        for group in ("velocity_rms_mps", "cep_rate_nmi_per_h"):
            for estimate in of_all[arm][group].values():
                assert set(estimate) == {"value", "interval95"}
    for pair in ("hysteresis/simple", "hysteresis_refined/simple", "hysteresis_refined/simple_refined"):
        for measure in ("velocity_rms_north", "velocity_rms_horizontal", "cep_rate_final"):
            assert set(of_all["improvement"][pair][measure]) >= {"ratio", "interval95"}
    assert numbers["floor"]["horizontal_m"] > 0.0
    assert set(numbers["budget"]) == {"size", "size_beside", *SOURCES}


def test_what_the_page_on_metrics_promises_is_there(numbers: dict[str, Any]) -> None:
    assert missing_figures("flight-report", numbers) == []
    assert "ensemble" in numbers["missions"]


def test_every_definition_has_words_formula_and_window(numbers: dict[str, Any]) -> None:
    assert set(numbers["definitions"]) >= {"velocity_rms", *DEFINITIONS}
    for definition in numbers["definitions"].values():
        assert all(definition[part] for part in ("words", "formula", "window", "source"))


def test_all_numbers_are_finite(numbers: dict[str, Any]) -> None:
    leaves = [(path, leaf) for path, leaf in walk(numbers) if isinstance(leaf, int | float)]
    assert len(leaves) > 500
    assert [path for path, leaf in leaves if not np.isfinite(leaf)] == []


def test_intervals_contain_their_values(numbers: dict[str, Any]) -> None:
    seen = 0
    for path, table in walk(numbers):
        if isinstance(table, dict) and "interval95" in table:
            low, high = table["interval95"]
            value = table["value"] if "value" in table else table["ratio"]
            assert low <= value <= high, path
            seen += 1
    assert seen > 100


def test_velocity_rms_and_cep_follow_from_the_members(numbers: dict[str, Any], flown) -> None:
    for arm in ARMS:
        of_arm = numbers["ensemble"][arm]
        for axis in AXES:
            expected = np.sqrt(np.mean(flown[arm][f"velocity_rms_{axis}"] ** 2))
            assert of_arm["velocity_rms_mps"][axis]["value"] == pytest.approx(expected, rel=1e-12)
        expected = np.median(flown[arm]["cep_rate_final"])
        assert of_arm["cep_rate_nmi_per_h"]["final"]["value"] == pytest.approx(expected, rel=1e-12)


def test_ratios_are_those_of_the_values(numbers: dict[str, Any]) -> None:
    of_all = numbers["ensemble"]
    for pair, measures in of_all["improvement"].items():
        first, second = pair.split("/")
        for axis in AXES:
            values = [of_all[arm]["velocity_rms_mps"][axis]["value"] for arm in (first, second)]
            assert measures[f"velocity_rms_{axis}"]["ratio"] == pytest.approx(values[0] / values[1], rel=1e-12)


def test_every_arm_is_better_than_nothing_and_above_the_floor(numbers: dict[str, Any]) -> None:
    floor = numbers["floor"]["ensemble"]["velocity_mps"]
    none = numbers["ensemble"]["none"]["velocity_rms_mps"]["horizontal"]["value"]
    for arm in set(ARMS) - {"none"}:
        assert 10.0 * floor < numbers["ensemble"][arm]["velocity_rms_mps"]["horizontal"]["value"] < none
    assert numbers["floor"]["horizontal_m"] < FLOOR_M


def test_metrics_hold_no_clock_host_or_path(small_report: Path, numbers: dict[str, Any]) -> None:
    text = (small_report / "metrics.json").read_text()
    for local in (socket.gethostname(), str(small_report), str(Path.cwd()), str(Path.home())):
        assert len(local) < 3 or local not in text
    words = [leaf for _, leaf in walk(numbers) if isinstance(leaf, str)]
    assert [word for word in words if re.search(r"(^|\s)(/|[A-Z]:\\)\w", word)] == []
    assert [word for word in words if re.search(r"20\d\d-\d\d-\d\d|\d\d:\d\d:\d\d", word)] == []
    leaves = [leaf for _, leaf in walk(numbers) if isinstance(leaf, int | float)]
    assert [leaf for leaf in leaves if abs(leaf - time.time()) < DAY_S] == []


def test_manifest_says_versions_seed_and_inputs(manifest: dict[str, Any], repository: Path) -> None:
    assert manifest["plan"]["seed"] == 1
    assert manifest["sizes"]["all"] == 4
    assert {"python", "ins-eval", "numpy", "scipy", "numba", "filterpy"} <= set(manifest["versions"])
    assert manifest["versions"]["numpy"] == np.__version__
    profile = repository / "trajectories" / "climb-cruise-landing.toml"
    assert manifest["inputs"][profile.name] == hashlib.sha256(profile.read_bytes()).hexdigest()


def test_budget_sources_add_up_to_the_whole(numbers: dict[str, Any], flown) -> None:
    """Independent sources add in squares; the gate is wide, as four instruments are few."""
    parts = [numbers["budget"][source]["simple"]["velocity_rms_horizontal"]["value"] for source in SOURCES]
    whole = metrics.root_mean_square(flown["simple"]["velocity_rms_horizontal"])
    assert 0.4 < np.sqrt(np.sum(np.square(parts))) / whole < 2.5


def test_page_text_and_figures_are_there(small_report: Path) -> None:
    assert (small_report / "index.html").stat().st_size > 0
    assert (small_report / "report.txt").stat().st_size > 0
    assert len(list((small_report / "figures").glob("*.svg"))) >= 10
    assert list(small_report.rglob("*.part")) == []
