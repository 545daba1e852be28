"""The printed numbers, once more by hand, against the one place where each of them stands."""

from __future__ import annotations

from ins_eval.studies.paper_b.printed import PRINTED

TABLE_3 = (
    (478.9735, 478.8887, -177.04, 11.48),
    (478.9761, 478.8861, -187.90, 6.05),
    (478.9697, 478.8828, -181.43, 9.28),
    (478.9771, 478.8909, -179.96, 10.02),
    (478.9706, 478.8851, -178.50, 10.75),
    (478.9764, 478.8910, -178.29, 10.85),
)
TABLE_4 = (
    (-71738.78, -71754.78, 223.03, 11.51),
    (-71738.14, -71753.42, 212.99, 6.50),
    (-71739.28, -71754.92, 218.01, 9.00),
    (-71739.21, -71754.63, 214.94, 7.47),
    (-71739.03, -71755.17, 224.98, 12.49),
    (-71738.67, -71754.09, 214.94, 7.47),
)
COLUMNS = ("before", "after", "drift_ppm", "residual_percent")


def test_tables_3_and_4() -> None:
    for name, rows in (("table3", TABLE_3), ("table4", TABLE_4)):
        for column, values in zip(COLUMNS, zip(*rows, strict=True), strict=True):
            assert tuple(PRINTED[name][column]) == values
    assert tuple(PRINTED["table3"]["mean"].values()) == (478.9739, 478.8874, -180.53, 9.74)
    assert tuple(PRINTED["table4"]["mean"].values()) == (-71738.85, -71754.50, 218.15, 9.08)


def test_tables_1_and_2() -> None:
    assert PRINTED["classes"]["bias_stability_ug"]["qfa"] == [5.0, 100.0]
    assert PRINTED["classes"]["scale_stability_ppm"]["qfa"] == [10.0, 100.0]
    assert PRINTED["static"] == {
        "bias_stability_ug": 50.0,
        "bias_repeatability_ug": 50.0,
        "scale_linearity_ppm": 30.0,
        "scale_repeatability_ppm": 30.0,
    }


def test_output_and_shares() -> None:
    assert (PRINTED["output"]["uncompensated_ug"], PRINTED["output"]["compensated_ug"]) == (193.0, 24.0)
    assert (PRINTED["output"]["residual_percent"], PRINTED["output"]["restrained_percent"]) == (12.44, 87.56)
    assert tuple(PRINTED["abstract"].values()) == (90.26, 90.92, 87.56)
    assert PRINTED["text"]["estimation_error_ppm"] == 10.0 and PRINTED["text"]["room_c"] == 3.0
