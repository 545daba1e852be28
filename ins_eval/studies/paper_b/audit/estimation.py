"""Tables 3 and 4 computed again, and what their residuals are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.units import PPM

Table = Literal["table3", "table4"]
SENSITIVITY_PPM_PER_C = (5.0, 10.0)  # of ordinary resistors, references and amplifiers


@dataclass(frozen=True)
class Repetitions:
    """A table's rows and means, from its two columns of gains; the injected drift in ppm."""

    injected_ppm: float
    drift_ppm: np.ndarray
    residual_percent: np.ndarray
    rounding_ppm: float  # by which half a last digit of both gains moves a drift

    @property
    def shift_ppm(self) -> np.ndarray:
        """Found less injected drift of each repetition."""
        return self.drift_ppm - self.injected_ppm


def of(table: Table) -> Repetitions:
    """delta = (after - before)/before and |delta - injected|/|injected| of each repetition."""
    rows = PRINTED[table]
    before, after = np.array(rows["before"]), np.array(rows["after"])
    drift = (after - before) / before / PPM
    digit = 1e-4 if table == "table3" else 1e-2
    return Repetitions(
        rows["injected_ppm"],
        drift,
        100.0 * np.abs(drift - rows["injected_ppm"]) / abs(rows["injected_ppm"]),
        digit / np.abs(before).min() / PPM,
    )


@dataclass(frozen=True)
class Shift:
    """Found less injected drift: its mean, standard deviation and the error of the mean, in ppm."""

    mean_ppm: float
    scatter_ppm: float
    error_ppm: float
    before_scatter_ppm: float  # standard deviation of the gain itself, before and after
    after_scatter_ppm: float
    correlation: float  # between the gains before and after of one repetition

    @property
    def sigmas(self) -> float:
        """Mean in units of its error: how far from 0."""
        return self.mean_ppm / self.error_ppm


def shift(table: Table) -> Shift:
    """Whether what is left is random or systematic."""
    rows, found = PRINTED[table], of(table).shift_ppm
    before, after = np.array(rows["before"]), np.array(rows["after"])
    scatter = found.std(ddof=1)
    return Shift(
        float(found.mean()),
        float(scatter),
        float(scatter / np.sqrt(found.size)),
        float(np.abs(before.std(ddof=1) / before.mean()) / PPM),
        float(np.abs(after.std(ddof=1) / after.mean()) / PPM),
        float(np.corrcoef(before, after)[0, 1]),
    )


def found_share_percent(table: Table) -> float:
    """Mean drift found over the injected one, in %: above 100 where more was found than was injected."""
    rows = of(table)
    return 100.0 * float(rows.drift_ppm.mean()) / rows.injected_ppm


def would_read_percent(table: Table, injected_ppm: float) -> float:
    """ "Estimated" share in %, as the paper counts it, had `injected_ppm` been injected with the same shift."""
    return 100.0 * (1.0 - abs(shift(table).mean_ppm) / abs(injected_ppm))


def expected_by_26_ppm() -> float:
    """Change of N_on - N_off, which is -I_ref/(k_VI k_DA) by eq. (26), for the injected feedback drift."""
    return (1.0 / (1.0 + PRINTED["table4"]["injected_ppm"] * PPM) - 1.0) / PPM


def tabled_change_ppm() -> float:
    """Mean change of the size of what Table 4 lists."""
    return float(of("table4").drift_ppm.mean())


def mean_residual_percent(table: Table) -> tuple[float, float, float]:
    """Mean of the printed residuals, residual of the printed mean drift, and residual from the gains themselves."""
    rows = PRINTED[table]
    injected = rows["injected_ppm"]
    return (
        float(np.mean(rows["residual_percent"])),
        100.0 * abs(rows["mean"]["drift_ppm"] - injected) / abs(injected),
        float(of(table).residual_percent.mean()),
    )


def over_claimed_error() -> list[float]:
    """Mean shift of Tables 3 and 4 over the error that the text claims."""
    return [abs(shift(table).mean_ppm) / PRINTED["text"]["estimation_error_ppm"] for table in ("table3", "table4")]


def room_ppm() -> tuple[float, float]:
    """What ordinary parts drift over the fluctuation of the room that the paper allows."""
    low, high = (s * PRINTED["text"]["room_c"] for s in SENSITIVITY_PPM_PER_C)
    return low, high
