"""The gate passes where the gain is real and fails where it is not, on made-up errors of known gain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from ins_eval.commands import check_cep
from ins_eval.commands.check_cep import HELD_SHARE, HYSTERESIS, MEASURES, MIRRORED, POWER, SIMPLE, Committed
from ins_eval.errors import GateNotMet
from ins_eval.tables import parse, read_toml

SIZE, COMMITTED_SIZE = 400, 3000
GAINS = {"cep_rate_final": (0.76, 0.023), "velocity_rms_horizontal": (0.89, 0.0065)}  # ratio, deviation of its log
CORRELATION = 0.8  # of the errors of one instrument under the two compensations
DEFAULT_SEED = 1


def members(
    factors: Mapping[str, float], mirrored: str | None = None, seed: int = 5, size: int = SIZE
) -> list[dict[str, dict[str, np.ndarray]]]:
    """An ensemble whose errors under hysteresis are `factors` times those under simple, in distribution.

    Errors are linear in what the compensation does, so those of the mirrored model are 2 simple - hysteresis.
    """
    rng = np.random.default_rng(seed)
    arms: dict[str, dict[str, np.ndarray]] = {SIMPLE: {}, HYSTERESIS: {}, MIRRORED: {}}
    for measure, factor in factors.items():
        simple = rng.standard_normal((size, 2))
        own = rng.standard_normal((size, 2))
        hysteresis = factor * (CORRELATION * simple + np.sqrt(1.0 - CORRELATION**2) * own)
        for arm, errors in ((SIMPLE, simple), (HYSTERESIS, hysteresis), (MIRRORED, 2.0 * simple - hysteresis)):
            arms[arm][measure] = np.hypot(*errors.T)
    if mirrored is not None:
        arms[MIRRORED] = arms[mirrored]
    return [{arm: {key: v[i] for key, v in values.items()} for arm, values in arms.items()} for i in range(size)]


@dataclass
class Gate:
    """The gate with a made-up ensemble in place of the flights."""

    folder: Path
    monkeypatch: pytest.MonkeyPatch

    @property
    def committed_file(self) -> Path:
        return self.folder / "gate.toml"

    def commit(self, gains: Mapping[str, tuple[float, float]] = GAINS) -> None:
        tables = [f"[{measure}]\nratio = {ratio}\nlog_sd = {sd}\n" for measure, (ratio, sd) in gains.items()]
        self.committed_file.write_text(f"size = {COMMITTED_SIZE}\nseed = 0\n" + "\n".join(tables))

    def run(self, made_up: list, commit: bool = False, size: int | None = SIZE) -> int:
        self.monkeypatch.setattr(check_cep.ensemble, "run", lambda plans, *_: {"gate": made_up})
        return check_cep.run(
            output=self.folder / "out",
            committed_file=self.committed_file,
            profile="climb-cruise-landing",
            seed=DEFAULT_SEED,
            workers=1,
            quiet=False,
            size=size,
            commit=commit,
        )


@pytest.fixture
def gate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Gate:
    made = Gate(tmp_path, monkeypatch)
    made.commit()
    return made


def factors(cep: float, velocity: float) -> dict[str, float]:
    return {"cep_rate_final": cep, "velocity_rms_horizontal": velocity}


def test_met_by_a_real_gain(gate: Gate, capsys) -> None:
    assert gate.run(members(factors(0.76, 0.88))) == 0
    printed = capsys.readouterr().out
    assert "gate: met" in printed
    assert printed.count("1.0, interval 1.0 to 1.0") == len(MEASURES)


@pytest.mark.parametrize("worse", [1.0, 1.3])
def test_fails_without_a_gain(gate: Gate, worse: float) -> None:
    with pytest.raises(GateNotMet, match="upper bound of the CEP rate .*upper bound of the horizontal velocity"):
        gate.run(members(factors(worse, worse)))


@pytest.mark.parametrize(("cep", "velocity", "named"), [(1.0, 0.8, "CEP rate"), (0.7, 1.0, "horizontal velocity RMS")])
def test_fails_where_one_measure_alone_has_no_gain(gate: Gate, cep: float, velocity: float, named: str) -> None:
    with pytest.raises(GateNotMet) as missed:
        gate.run(members(factors(cep, velocity)))
    (other,) = {"CEP rate", "horizontal velocity RMS"} - {named}
    assert named in str(missed.value)
    assert other not in str(missed.value)
    assert "\n" not in str(missed.value)


def test_fails_where_the_gain_is_sure_but_below_half_of_the_committed_one(gate: Gate) -> None:
    """A gain of 8 % among very many instruments, where 24 % are committed."""
    with pytest.raises(GateNotMet, match="gain in CEP rate .* half of the committed 24.0 %") as missed:
        gate.run(members(factors(0.92, 0.85), size=6000), size=6000)
    assert "upper bound" not in str(missed.value)


def test_half_of_the_committed_gain_is_enough(gate: Gate) -> None:
    assert gate.run(members(factors(0.85, 0.90), size=6000), size=6000) == 0


@pytest.mark.parametrize("mirrored", [HYSTERESIS])
def test_fails_where_the_mirrored_control_passes(gate: Gate, mirrored: str) -> None:
    with pytest.raises(GateNotMet, match=f"control '{MIRRORED}' passed"):
        gate.run(members(factors(0.76, 0.88), mirrored=mirrored))


def test_fails_where_a_model_against_itself_is_not_exactly_one(gate: Gate, monkeypatch) -> None:
    bootstrap = check_cep.metrics.paired_bootstrap

    def nearly(*arguments: object):
        found = bootstrap(*arguments)
        pair = found.ratios[f"{SIMPLE}/{SIMPLE}"]
        pair["cep_rate_final"] = pair["cep_rate_final"]._replace(high=1.0 + 1e-15)
        return found

    monkeypatch.setattr(check_cep.metrics, "paired_bootstrap", nearly)
    with pytest.raises(GateNotMet, match="not exactly 1"):
        gate.run(members(factors(0.76, 0.88)))


def test_pairs_are_resampled_together(gate: Gate, capsys) -> None:
    """With nearly equal pairs a gain of 3 % is sure, which it would not be if the arms were resampled apart."""
    gate.commit({"cep_rate_final": (0.97, 0.001), "velocity_rms_horizontal": (0.97, 0.001)})
    rng = np.random.default_rng(7)
    radius = rng.rayleigh(size=(200, 2))
    made_up = [
        {
            SIMPLE: dict(zip(MEASURES, row, strict=True)),
            HYSTERESIS: dict(zip(MEASURES, 0.97 * row, strict=True)),
            MIRRORED: dict(zip(MEASURES, 1.03 * row, strict=True)),
        }
        for row in radius
    ]
    assert gate.run(made_up) == 0


def test_size_has_the_power_that_is_stated(gate: Gate, monkeypatch, capsys) -> None:
    """Normal theory of the log ratio, written out: both bounds and both gains hold with 99.5 %, not with a third less.

    Of an ensemble of N: log R ~ Normal(log ratio, (sd sqrt(n/N))^2).
    """
    asked: list[int] = []

    def run(plans, *_: object):
        asked.append(plans["gate"][1])
        return {"gate": members(factors(0.76, 0.88))}

    monkeypatch.setattr(check_cep.ensemble, "run", run)
    check_cep.run(gate.folder, gate.committed_file, "climb-cruise-landing", 1, 1, False)
    (size,) = asked
    assert f"{size} paired instruments" in capsys.readouterr().out
    assert power(size) >= POWER
    assert power(int(0.7 * size)) < POWER


def power(size: int) -> float:
    """Probability that every condition of the gate holds, at worst (Bonferroni)."""
    missed = 0.0
    for ratio, log_sd in GAINS.values():
        sd = log_sd * np.sqrt(COMMITTED_SIZE / size)
        bound = (0.0 - 1.96 * sd - log(ratio)) / sd
        half = (log(1.0 - HELD_SHARE * (1.0 - ratio)) - log(ratio)) / sd
        missed += stats.norm.sf(bound) + stats.norm.sf(half)
    return 1.0 - missed


def test_what_is_committed_is_what_is_then_held(gate: Gate, capsys) -> None:
    made_up = members(factors(0.76, 0.88))
    gate.committed_file.unlink()
    assert gate.run(made_up, commit=True) == 0
    found = parse(Committed, read_toml(gate.committed_file), "")
    assert found.size == SIZE
    ratio = np.median([m[HYSTERESIS]["cep_rate_final"] for m in made_up]) / np.median(
        [m[SIMPLE]["cep_rate_final"] for m in made_up]
    )
    assert found.cep_rate_final.ratio == pytest.approx(ratio, abs=1e-4)
    assert gate.run(made_up) == 0


def test_committed_gains_were_not_found_with_the_seed_of_the_gate(repository: Path) -> None:
    committed = parse(Committed, read_toml(repository / "tests/golden/cep-gate.toml"), "")
    assert committed.seed != DEFAULT_SEED
    assert committed.size >= 1000


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_real_gate_is_met(seed: int, repository: Path, tmp_path: Path, capsys) -> None:
    from ins_eval.cli import main

    committed = str(repository / "tests/golden/cep-gate.toml")
    code = main(["check-cep", "--seed", str(seed), "--committed", committed, "--output", str(tmp_path)])
    assert code == 0, capsys.readouterr().err
