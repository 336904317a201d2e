//! Where the sun stands at a place and a time: the equations of NOAA's solar calculator, after Meeus, Astronomical
//! Algorithms (1998). Within 0.02 degrees of an ephemeris between 1950 and 2050.

/// A moment in universal time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniversalTime {
    /// Gregorian year, 1800 to 2200.
    pub year: i32,
    /// 1 to 12.
    pub month: u32,
    /// 1 to 31.
    pub day: u32,
    /// Since midnight; may be negative or above 24.
    pub hours: f64,
}

/// Where the sun stands, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolarPosition {
    /// Clockwise from true north, 0 to 360.
    pub compass_deg: f64,
    /// Above the horizon, with refraction; negative at night.
    pub elevation_deg: f64,
}

/// Declination in degrees and equation of time in minutes.
struct Orbit {
    declination_deg: f64,
    equation_of_time_min: f64,
}

impl UniversalTime {
    /// Days since 4713 BC, noon (Fliegel & Van Flandern 1968 for the date).
    fn julian_day(self) -> f64 {
        let (y, m, d) = (i64::from(self.year), i64::from(self.month), i64::from(self.day));
        let a = (m - 14) / 12;
        let noon = (1461 * (y + 4800 + a)) / 4 + (367 * (m - 2 - 12 * a)) / 12
            - (3 * ((y + 4900 + a) / 100)) / 4
            + d
            - 32_075;
        noon as f64 - 0.5 + self.hours / 24.0
    }

    fn orbit(self) -> Orbit {
        let t = (self.julian_day() - 2_451_545.0) / 36_525.0;
        let mean_longitude =
            (280.466_46 + t * (36_000.769_83 + t * 0.000_303_2)).rem_euclid(360.0).to_radians();
        let anomaly = (357.529_11 + t * (35_999.050_29 - 0.000_153_7 * t)).to_radians();
        let eccentricity = 0.016_708_634 - t * (0.000_042_037 + 0.000_000_126_7 * t);
        let center = anomaly.sin() * (1.914_602 - t * (0.004_817 + 0.000_014 * t))
            + (2.0 * anomaly).sin() * (0.019_993 - 0.000_101 * t)
            + (3.0 * anomaly).sin() * 0.000_289;
        let node = (125.04 - 1934.136 * t).to_radians();
        let longitude = mean_longitude + (center - 0.005_69 - 0.004_78 * node.sin()).to_radians();
        let seconds = 21.448 - t * (46.815 + t * (0.000_59 - t * 0.001_813));
        let mean_obliquity = 23.0 + (26.0 + seconds / 60.0) / 60.0;
        let obliquity = (mean_obliquity + 0.002_56 * node.cos()).to_radians();
        let y = (0.5 * obliquity).tan().powi(2);
        let (e, l) = (eccentricity, mean_longitude);
        let equation_of_time = y * (2.0 * l).sin() - 2.0 * e * anomaly.sin()
            + 4.0 * e * y * anomaly.sin() * (2.0 * l).cos()
            - 0.5 * y * y * (4.0 * l).sin()
            - 1.25 * e * e * (2.0 * anomaly).sin();
        Orbit {
            declination_deg: (obliquity.sin() * longitude.sin()).asin().to_degrees(),
            equation_of_time_min: 4.0 * equation_of_time.to_degrees(),
        }
    }
}

/// The sun over `latitude_deg` (north positive) and `longitude_deg` (east positive).
pub fn solar_position(latitude_deg: f64, longitude_deg: f64, time: UniversalTime) -> SolarPosition {
    let orbit = time.orbit();
    let minutes = 60.0 * time.hours + orbit.equation_of_time_min + 4.0 * longitude_deg;
    let hour_angle = (minutes / 4.0 - 180.0).to_radians();
    let (latitude, declination) = (latitude_deg.to_radians(), orbit.declination_deg.to_radians());
    let sin_elevation =
        latitude.sin() * declination.sin() + latitude.cos() * declination.cos() * hour_angle.cos();
    let elevation = sin_elevation.clamp(-1.0, 1.0).asin().to_degrees();
    let west = hour_angle.sin() * declination.cos();
    let south =
        hour_angle.cos() * latitude.sin() * declination.cos() - declination.sin() * latitude.cos();
    let compass_deg = (west.atan2(south).to_degrees() + 180.0).rem_euclid(360.0);
    SolarPosition { compass_deg, elevation_deg: elevation + refraction_deg(elevation) }
}

/// How much the air lifts the sun.
fn refraction_deg(elevation_deg: f64) -> f64 {
    let (e, tan) = (elevation_deg, elevation_deg.to_radians().tan());
    let seconds = if e > 85.0 {
        0.0
    } else if e > 5.0 {
        58.1 / tan - 0.07 / tan.powi(3) + 0.000_086 / tan.powi(5)
    } else if e > -0.575 {
        1735.0 + e * (-518.2 + e * (103.4 + e * (-12.79 + e * 0.711)))
    } else {
        -20.772 / tan
    };
    seconds / 3600.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_where_published_examples_have_it() {
        // Reda & Andreas 2004 (NREL/TP-560-34302), appendix: zenith 50.11162, azimuth 194.34024.
        let time = UniversalTime { year: 2003, month: 10, day: 17, hours: 19.0 + 30.5 / 60.0 };
        let sun = solar_position(39.742_476, -105.178_6, time);
        assert!((sun.compass_deg - 194.340_24).abs() < 0.02, "{sun:?}");
        assert!((90.0 - sun.elevation_deg - 50.111_62).abs() < 0.02, "{sun:?}");
        // Meeus 1998, examples 25.a and 28.b: 1992 October 13, 0h.
        let orbit = UniversalTime { year: 1992, month: 10, day: 13, hours: 0.0 }.orbit();
        assert!((orbit.declination_deg + 7.785_07).abs() < 1e-3, "{}", orbit.declination_deg);
        assert!(
            (orbit.equation_of_time_min - 13.711).abs() < 0.02,
            "{}",
            orbit.equation_of_time_min
        );
    }

    #[test]
    fn days_run_from_east_over_the_equators_side_to_west() {
        let at = |latitude, hours| {
            solar_position(latitude, 0.0, UniversalTime { year: 2026, month: 6, day: 21, hours })
        };
        // Midsummer noon: 90 - latitude + obliquity.
        let noon = at(51.5, 12.0);
        assert!(
            (noon.elevation_deg - 61.94).abs() < 0.05 && (noon.compass_deg - 180.0).abs() < 2.0
        );
        assert!(at(-33.9, 12.0).compass_deg.cos() > 0.0 && at(-33.9, 12.0).elevation_deg < 33.0);
        let (morning, evening) = (at(51.5, 6.0), at(51.5, 18.0));
        assert!(morning.compass_deg < 90.0 && evening.compass_deg > 270.0);
        assert!(at(51.5, 0.0).elevation_deg < 0.0 && at(70.0, 0.0).elevation_deg > 0.0);
        for latitude in [-90.0, 0.0, 90.0] {
            let sun = at(latitude, 3.0);
            assert!(sun.compass_deg.is_finite() && sun.elevation_deg.abs() <= 90.6);
        }
    }
}
