"""Recorded scans and current tests: what is read, and the one sentence for what cannot be used."""

import numpy as np
import pytest

from ins_eval.calibration.loop_readings import read
from ins_eval.errors import DataRefused, UsageError

SCAN = "state,repetition,n_fpga,n_out\n"
CURRENT = "state,repetition,current,n_out\n"
REFERENCE = "reference,1,800,10\nreference,1,900,20\nreference,1,1000,30\n"
TEST = "test,1,800,11\ntest,1,900,21\ntest,1,1000,31\n"


@pytest.fixture
def written(tmp_path):
    def write(text, name="scan.csv"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_scans_come_in_order_of_their_points_and_repetitions(written):
    later = "reference,2,1000,33\nreference,2,800,13\nreference,2,900,23\n"
    found = read([written(SCAN + later + REFERENCE)])
    np.testing.assert_array_equal(found.n_fpga, [800.0, 900.0, 1000.0])
    np.testing.assert_array_equal(found.scans["reference"], [[10.0, 20.0, 30.0], [13.0, 23.0, 33.0]])
    assert set(found.scans) == {"reference"}
    assert not found.currents


def test_states_may_stand_in_files_of_their_own(written):
    found = read([written(SCAN + TEST, "b.csv"), written("# bench 3\n" + SCAN + REFERENCE, "a.csv")])
    np.testing.assert_array_equal(found.scans["test"], [[11.0, 21.0, 31.0]])


def test_currents_are_split_by_the_switch(written):
    found = read([written(CURRENT + "reference,1,off,5\nreference,1,on,-7\nreference,1,on,-8\n")])
    on, off = found.currents["reference"][0]
    assert (on.tolist(), off.tolist()) == ([-7.0, -8.0], [5.0])
    assert found.n_fpga.size == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("a,b\n1,2\n", "has the columns a, b; expected state, repetition, n_fpga, n_out"),
        (SCAN, "has no rows"),
        (SCAN + "before,1,800,10\n", "row 1, state is 'before'; expected 'reference' or 'test'"),
        (SCAN + "reference,1,800,ten\n", "row 1, n_out is 'ten'; expected a finite number"),
        (SCAN + REFERENCE + "reference,1,1100,inf\n", "row 4, n_out is 'inf'"),
        (SCAN + "reference,1.5,800,10\n", "expected a whole number"),
        (SCAN + "reference,1,800\nreference,1,900,10,11\n", "not a CSV table"),
        (SCAN + "reference,1,800,10\nreference,1,900,20\n", "expected 3 or more"),
        (SCAN + REFERENCE + "reference,1,800,10\n", "N_FPGA = 800 twice"),
        (SCAN + TEST, "no scan of state 'reference'"),
        (SCAN + REFERENCE + TEST.replace("test,1", "test,2"), "repetition 1 of the scan is there in one state only"),
        (SCAN + REFERENCE + TEST.replace("1000", "1100"), "lacks N_FPGA = "),
        (CURRENT + "reference,1,closed,5\n", "current is 'closed'; expected 'on' or 'off'"),
        (CURRENT + "reference,1,on,5\n", "no reading with the current off"),
    ],
)
def test_a_fault_is_one_sentence(written, text, said):
    with pytest.raises((UsageError, DataRefused), match=r"scan\.csv") as refused:
        read([written(text)])
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(UsageError, match="no such file"):
        read([tmp_path / "none.csv"])
    with pytest.raises(UsageError, match="is a folder"):
        read([tmp_path])
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(UsageError, match="not a CSV table"):
        read([tmp_path / "binary.csv"])
