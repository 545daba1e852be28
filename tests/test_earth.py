"""WGS-84 against published values, pymap3d, python-ins and the closed form of the normal potential."""

from __future__ import annotations

import numpy as np
import pyins.earth
import pymap3d
import pymap3d.rcurve
import pytest

from ins_eval import earth

GRAVITY_TOLERANCE = 1e-9  # m/s^2, of the published digits
RADIUS_TOLERANCE_M = 1e-6
HEIGHT_TOLERANCE = 1e-6  # m/s^2 up to 10 km: what a series of second order in height leaves out (7e-7 at the equator)
LATITUDES_RAD = np.deg2rad(np.linspace(-85.0, 85.0, 18))


def normal_potential(x: float, z: float) -> float:
    """Gravity potential of the level ellipsoid at distance `x` from the axis and `z` from the equator, m^2/s^2.

    Closed form in ellipsoidal-harmonic coordinates (Heiskanen and Moritz, Physical Geodesy, eq. 2-62).
    """
    a, rate = earth.SEMI_MAJOR_AXIS_M, earth.EARTH_RATE
    b = a * (1.0 - earth.FLATTENING)
    e = np.sqrt(a * a - b * b)

    def q(u: float) -> float:
        return 0.5 * ((1.0 + 3.0 * u * u / (e * e)) * np.arctan(e / u) - 3.0 * u / e)

    w = x * x + z * z - e * e
    u = np.sqrt(0.5 * w * (1.0 + np.sqrt(1.0 + 4.0 * e * e * z * z / (w * w))))
    sine = z / u
    return (
        earth.GM / e * np.arctan(e / u)
        + 0.5 * rate**2 * a**2 * q(u) / q(b) * (sine**2 - 1.0 / 3.0)
        + 0.5 * rate**2 * x * x
    )


def normal_gravity(latitude_rad: float, height_m: float, step_m: float = 1000.0) -> float:
    """Downward derivative of the normal potential along the ellipsoid's normal, by a fourth-order difference."""

    def potential(height: float) -> float:
        x, _, z = pymap3d.geodetic2ecef(latitude_rad, 0.0, height, deg=False)
        return normal_potential(x, z)

    near = potential(height_m - step_m) - potential(height_m + step_m)
    far = potential(height_m - 2.0 * step_m) - potential(height_m + 2.0 * step_m)
    return (8.0 * near - far) / (12.0 * step_m)


@pytest.mark.parametrize(
    ("latitude_deg", "published"), [(0.0, 9.7803253359), (45.0, 9.806197769), (90.0, 9.8321849378)]
)
def test_normal_gravity_has_the_published_values(latitude_deg: float, published: float) -> None:
    """Somigliana's formula at equator, 45 degrees and pole (NGA.STND.0036)."""
    assert earth.gravity(np.deg2rad(latitude_deg), 0.0) == pytest.approx(published, abs=GRAVITY_TOLERANCE)


@pytest.mark.parametrize("height_m", [0.0, 400.0, 5000.0, 10000.0])
@pytest.mark.parametrize("latitude_deg", [-80.0, -45.0, 0.0, 34.65, 70.0])
def test_gravity_with_height_is_the_gradient_of_the_normal_potential(latitude_deg: float, height_m: float) -> None:
    """g = -dU/dh of the level ellipsoid's potential, in closed form and without a series in height."""
    latitude = np.deg2rad(latitude_deg)
    assert earth.gravity(latitude, height_m) == pytest.approx(normal_gravity(latitude, height_m), abs=HEIGHT_TOLERANCE)


def test_radii_are_those_of_pymap3d() -> None:
    """Meridian and transverse radius of curvature of WGS-84."""
    meridian, transverse = earth.radii(LATITUDES_RAD)
    assert meridian == pytest.approx(pymap3d.rcurve.meridian(LATITUDES_RAD, deg=False), abs=RADIUS_TOLERANCE_M)
    assert transverse == pytest.approx(pymap3d.rcurve.transverse(LATITUDES_RAD, deg=False), abs=RADIUS_TOLERANCE_M)


def test_radii_and_gravity_are_those_of_python_ins() -> None:
    """The same quantities in an independent navigation library (its gravity is linear in height: compared at 0 m)."""
    north, east, _ = pyins.earth.principal_radii(np.rad2deg(LATITUDES_RAD), 0.0)
    meridian, transverse = earth.radii(LATITUDES_RAD)
    assert meridian == pytest.approx(north, abs=RADIUS_TOLERANCE_M)
    assert transverse == pytest.approx(east, abs=RADIUS_TOLERANCE_M)
    theirs = pyins.earth.gravity(np.rad2deg(LATITUDES_RAD), 0.0)
    assert earth.gravity(LATITUDES_RAD, np.zeros(LATITUDES_RAD.size)) == pytest.approx(theirs, abs=GRAVITY_TOLERANCE)
    assert earth.EARTH_RATE == pyins.earth.RATE


def test_a_step_north_and_east_is_as_long_as_on_the_ellipsoid() -> None:
    """(M + h) dL and (N + h) cos(L) dl against chords in Earth-fixed coordinates."""
    latitude, height, angle = 0.6, 10000.0, 1e-5
    meridian, transverse = earth.radii(latitude)
    here = np.array(pymap3d.geodetic2ecef(latitude, 0.3, height, deg=False))
    north = np.array(pymap3d.geodetic2ecef(latitude + angle, 0.3, height, deg=False))
    east = np.array(pymap3d.geodetic2ecef(latitude, 0.3 + angle, height, deg=False))
    assert (meridian + height) * angle == pytest.approx(np.linalg.norm(north - here), rel=1e-6)
    assert (transverse + height) * np.cos(latitude) * angle == pytest.approx(np.linalg.norm(east - here), rel=1e-8)


def test_scalars_go_in_and_scalars_come_out() -> None:
    """One function for scalars and arrays."""
    assert np.ndim(earth.gravity(0.5, 100.0)) == 0
    assert earth.gravity(np.array([0.5, 0.6]), np.array([100.0, 200.0])).shape == (2,)
    assert [np.ndim(radius) for radius in earth.radii(0.5)] == [0, 0]
