"""What has no name as a column of its recording, against the window of the package that it is."""

from __future__ import annotations

import numpy as np
import pytest

from benchmark.runners import bound
from benchmark.scores import oracle
from benchmark.scores.oracle import nominal
from benchmark.worlds import cases
from ins_eval.believed import believed
from ins_eval.diagnosis.unnamed.locate import channels
from ins_eval.estimation.case import prepare
from ins_eval.estimation.evidence import reduce
from ins_eval.recording import form

SEED, RATE_HZ = 3, 10.0
MANIFEST = {"made": [{"set": "development", "seed": SEED, "rate_hz": RATE_HZ}]}
ALIKE = 0.98  # correlation: the maker's window has edges of 10 s, and its recording begins at any time of day
SIZE = 0.02


# an accelerometer, recorded from 30144 s on; a gyro; GPS velocity
@pytest.mark.parametrize("index", [pytest.param(1, marks=pytest.mark.slow), 4, 7])
def test_what_has_no_name_is_drawn_again_as_it_acted(index, tmp_path):
    drawn = cases.draw("development", SEED, "limited", index, RATE_HZ)
    drawn.made[0].save(tmp_path / drawn.name)
    case = prepare(believed(form.read(tmp_path / drawn.name)))
    one = bound._nameless(drawn.truth, MANIFEST, case)
    (effect,) = drawn.truth["effects"]
    axis = effect["axis"].upper() if drawn.truth["channel"].startswith("gps") else effect["axis"]
    channel = next(c for c in channels(case) if (c.name, c.axis) == (drawn.truth["channel"], axis))
    window = channel.column(case.slow.add_window(*drawn.truth["interval_s"], case.model))
    whitened = case.whitened([one.columns[0], window], np.zeros(len(case.noise.free)))
    a = reduce(whitened, len(case.nuisances)).normal
    assert abs(a[0, 1]) / np.sqrt(a[0, 0] * a[1, 1]) > ALIKE
    si = {"accelerometer": bound.UG, "gyro": bound.DEG_PER_H, "gps": 1.0}[channel.name.partition(".")[0]]
    expected = abs(nominal(drawn.hidden[0]).value) * si / channel.size
    assert np.sqrt(a[0, 0] / a[1, 1]) == pytest.approx(expected, rel=SIZE)


def test_with_the_noise_to_be_estimated_less_can_be_told(tmp_path):
    """The D of an oracle that knows the noise is the most; of a clear effect something remains."""
    drawn = cases.draw("development", SEED, "limited", 4, RATE_HZ)
    drawn.made[0].save(tmp_path / drawn.name)
    known = oracle.judge(drawn)["log_bayes_factor"]
    found = bound.reached(drawn.truth, {}, [tmp_path / drawn.name], MANIFEST)
    assert 0.0 < found["log_bayes_factor"] < known
    assert found["removed"] is found["answer_below"] is None
