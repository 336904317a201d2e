//! What `--sun` takes: an hour by name, angles, or a place and a time.

use std::str::FromStr;

use motes_shading::environment::{OvercastSky, StudioLight, SunSky, UniversalTime, solar_position};
use serde::Serialize;

/// A sky of the analytic models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sky {
    /// With a sun.
    Clear(SunSky),
    /// Behind clouds.
    Overcast(OvercastSky),
    /// No sky: lamps.
    Studio(StudioLight),
}

/// An hour that has a name.
struct Preset {
    name: &'static str,
    /// Degrees above the horizon; none without a sun.
    elevation_deg: Option<f64>,
    /// Clockwise from north.
    compass_deg: f64,
}

/// The light without a sky.
const STUDIO: &str = "studio";

const PRESETS: [Preset; 8] = [
    Preset { name: "sunrise", elevation_deg: Some(6.0), compass_deg: 90.0 },
    Preset { name: "morning", elevation_deg: Some(25.0), compass_deg: 110.0 },
    Preset { name: "noon", elevation_deg: Some(60.0), compass_deg: 180.0 },
    Preset { name: "afternoon", elevation_deg: Some(35.0), compass_deg: 240.0 },
    Preset { name: "golden-hour", elevation_deg: Some(10.0), compass_deg: 265.0 },
    Preset { name: "sunset", elevation_deg: Some(3.0), compass_deg: 270.0 },
    Preset { name: "overcast", elevation_deg: None, compass_deg: 180.0 },
    Preset { name: STUDIO, elevation_deg: None, compass_deg: 180.0 },
];

const KEYS: [&str; 9] = [
    "azimuth",
    "elevation",
    "turbidity",
    "ground",
    "latitude",
    "longitude",
    "date",
    "time",
    "north",
];

const FORM: &str = "expected sunrise, morning, noon, afternoon, golden-hour, sunset, overcast or studio, or \
    azimuth=DEG,elevation=DEG, or latitude=DEG,longitude=DEG,date=YYYY-MM-DD,time=HH:MM[+HH:MM]; \
    further keys: turbidity, ground, north";

/// A sky, and whether it was asked for by a word or a time, which bring the dome with the sun.
#[derive(Clone, Debug, PartialEq)]
pub struct SunOption {
    /// The sky.
    pub sky: Sky,
    /// Whether the dome belongs to it without `--sky`.
    pub with_dome: bool,
    text: String,
}

impl SunOption {
    /// Luminance of the light is known: the models are in W / (m² sr).
    pub fn text(&self) -> &str {
        &self.text
    }
}

impl FromStr for SunOption {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split(',').map(str::trim).peekable();
        let named = |part: &str| PRESETS.iter().find(|preset| preset.name == part);
        let preset = parts.peek().and_then(|part| named(part));
        if preset.is_some() {
            parts.next();
        }
        let mut values: [Option<&str>; KEYS.len()] = [None; KEYS.len()];
        for part in parts {
            let (key, value) = part.split_once('=').ok_or(FORM)?;
            let place = KEYS.iter().position(|known| *known == key.trim()).ok_or(FORM)?;
            if values[place].replace(value.trim()).is_some() {
                return Err(format!("{} is given twice", key.trim()));
            }
        }
        let sky = Values(values).sky(preset)?;
        let with_dome = preset.is_some() || values[6].is_some();
        Ok(Self { sky, with_dome, text: text.into() })
    }
}

/// Values by the order of [`KEYS`].
struct Values<'a>([Option<&'a str>; KEYS.len()]);

impl Values<'_> {
    fn number(&self, key: &str, low: f64, high: f64) -> Result<Option<f64>, String> {
        let place = KEYS.iter().position(|known| *known == key).unwrap_or(0);
        let Some(text) = self.0[place] else { return Ok(None) };
        let value: Option<f64> = text.parse().ok();
        match value.filter(|v| v.is_finite()) {
            Some(v) if (low..=high).contains(&v) => Ok(Some(v)),
            Some(_) => Err(format!("{key} is {low} to {high}, not {text}")),
            None => Err(format!("\"{text}\" is no number")),
        }
    }

    fn sky(&self, preset: Option<&Preset>) -> Result<Sky, String> {
        let ground = self.number("ground", 0.0, 1.0)?.unwrap_or(0.3);
        let turbidity = self.number("turbidity", 1.0, 10.0)?;
        let azimuth = self.number("azimuth", -1e6, 1e6)?;
        let elevation = self.number("elevation", 0.0, 90.0)?;
        let of_place = [4, 5, 6, 7].map(|k: usize| self.0[k]);
        let (azimuth, elevation) = match (preset, of_place) {
            (Some(preset), [None, None, None, None]) if preset.name == STUDIO => {
                if turbidity.is_some() || elevation.is_some() {
                    return Err("a studio has neither sun nor turbidity".into());
                }
                return Ok(Sky::Studio(StudioLight {
                    azimuth_deg: azimuth.unwrap_or(0.0),
                    ..StudioLight::default()
                }));
            }
            (Some(Preset { elevation_deg: None, .. }), [None, None, None, None]) => {
                if turbidity.is_some() || elevation.is_some() {
                    return Err("an overcast sky has neither sun nor turbidity".into());
                }
                return Ok(Sky::Overcast(OvercastSky {
                    ground_albedo: ground,
                    ..OvercastSky::default()
                }));
            }
            (Some(preset), [None, None, None, None]) => {
                let usual = self.scene_azimuth(preset.compass_deg)?;
                (azimuth.unwrap_or(usual), elevation.or(preset.elevation_deg).unwrap_or(45.0))
            }
            (None, [Some(_), Some(_), Some(date), Some(time)]) => {
                if azimuth.is_some() || elevation.is_some() {
                    return Err("a place and a time give azimuth and elevation".into());
                }
                self.at(date, time)?
            }
            (None, [None, None, None, None]) => {
                let both = azimuth.zip(elevation);
                both.ok_or_else(|| format!("the sun needs azimuth=DEG and elevation=DEG; {FORM}"))?
            }
            (Some(_), _) => return Err("a name and a place exclude each other".into()),
            (None, _) => {
                return Err("latitude, longitude, date and time belong together".into());
            }
        };
        let usual = SunSky::usual_at(azimuth, elevation);
        let sun = match turbidity {
            Some(turbidity) => SunSky { turbidity, forward_scatter: 0.0, ..usual },
            None => usual,
        };
        Ok(Sky::Clear(SunSky { ground_albedo: ground, ..sun }))
    }

    /// Azimuth in the scene's frame, counter-clockwise, of a direction of the compass.
    fn scene_azimuth(&self, compass_deg: f64) -> Result<f64, String> {
        let north = self.number("north", -360.0, 360.0)?.unwrap_or(90.0);
        let azimuth = (north - compass_deg).rem_euclid(360.0);
        Ok(if azimuth > 180.0 { azimuth - 360.0 } else { azimuth })
    }

    /// Azimuth in the scene's frame and elevation at a place and a time.
    fn at(&self, date: &str, time: &str) -> Result<(f64, f64), String> {
        let need = |value: Option<f64>| value.ok_or("latitude and longitude belong together");
        let latitude = need(self.number("latitude", -90.0, 90.0)?)?;
        let longitude = need(self.number("longitude", -180.0, 180.0)?)?;
        let moment = universal_time(date, time)?;
        let sun = solar_position(latitude, longitude, moment);
        // The disc's upper edge is on the horizon when its center is a quarter of a degree below.
        if sun.elevation_deg < -0.27 {
            return Err(format!(
                "the sun is {:.1} degrees below the horizon there and then: the sky model has no night; take another time",
                -sun.elevation_deg
            ));
        }
        Ok((self.scene_azimuth(sun.compass_deg)?, sun.elevation_deg.clamp(0.0, 90.0)))
    }
}

fn universal_time(date: &str, time: &str) -> Result<UniversalTime, String> {
    let form =
        "expected date=YYYY-MM-DD and time=HH:MM, in UTC, or with an offset as in 06:30+02:00";
    let number = |text: Option<&str>| text.and_then(|t| t.parse::<u32>().ok()).ok_or(form);
    let mut parts = date.split('-');
    let (year, month, day) = (number(parts.next())?, number(parts.next())?, number(parts.next())?);
    let hours = |text: &str| -> Result<f64, String> {
        let mut parts = text.split(':');
        let (hour, minute) = (number(parts.next())?, number(parts.next())?);
        if hour > 23 || minute > 59 || parts.next().is_some() {
            return Err(form.into());
        }
        Ok(f64::from(hour) + f64::from(minute) / 60.0)
    };
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + u32::from(is_leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => 0,
    };
    if parts.next().is_some() || !(1800..=2200).contains(&year) || !(1..=days).contains(&day) {
        return Err(format!("\"{date}\" is no date from 1800 to 2200: {form}"));
    }
    let time = time.strip_suffix('Z').unwrap_or(time);
    let (clock, offset) = match time.find(['+', '-']) {
        Some(at) => {
            let sign = if time.as_bytes()[at] == b'-' { -1.0 } else { 1.0 };
            (&time[..at], sign * hours(&time[at + 1..])?)
        }
        None => (time, 0.0),
    };
    Ok(UniversalTime { year: year as i32, month, day, hours: hours(clock)? - offset })
}

impl Serialize for SunOption {
    /// As the flag takes it.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sun(text: &str) -> SunSky {
        match text.parse::<SunOption>().unwrap().sky {
            Sky::Clear(sun) => sun,
            Sky::Overcast(_) | Sky::Studio(_) => panic!("{text} has a sun"),
        }
    }

    #[test]
    fn angles_names_places_and_times_are_read() {
        let plain = sun("azimuth=120, elevation=8,turbidity=3");
        assert_eq!((plain.azimuth_deg, plain.elevation_deg, plain.turbidity), (120.0, 8.0, 3.0));
        assert_eq!(plain.forward_scatter, 0.0, "a given turbidity is the textbook's");
        assert!(!"azimuth=120,elevation=8".parse::<SunOption>().unwrap().with_dome);
        let sunrise = sun("sunrise");
        assert_eq!((sunrise.azimuth_deg, sunrise.elevation_deg), (0.0, 6.0));
        assert_eq!(sun("golden-hour,azimuth=30").azimuth_deg, 30.0);
        assert!("noon".parse::<SunOption>().unwrap().with_dome);
        assert!(matches!(
            "overcast,ground=0.1".parse::<SunOption>().unwrap().sky,
            Sky::Overcast(_)
        ));
        // Boulder, see `solar_position`; x is east, y north.
        let there = sun("latitude=39.742476,longitude=-105.1786,date=2003-10-17,time=12:30-07:00");
        assert!((there.elevation_deg - 39.9).abs() < 0.1, "{there:?}");
        assert!((there.azimuth_deg - (90.0 - 194.2)).abs() < 0.3, "{there:?}");
        let turned =
            sun("latitude=39.742476,longitude=-105.1786,date=2003-10-17,time=19:30Z,north=0");
        assert!((turned.azimuth_deg + 194.2 - 360.0).abs() < 0.3, "{turned:?}");
    }

    #[test]
    fn what_makes_no_sky_is_said() {
        for (bad, why) in [
            ("", "expected sunrise"),
            ("dawn", "expected sunrise"),
            ("azimuth=1", "azimuth=DEG and elevation=DEG"),
            ("azimuth=1,elevation=91", "elevation is 0 to 90"),
            ("azimuth=1,elevation=NaN", "no number"),
            ("azimuth=1,azimuth=2,elevation=3", "twice"),
            ("azimuth=1,elevation=2,hue=3", "expected"),
            ("azimuth=1,elevation=2,turbidity=0", "turbidity is 1 to 10"),
            ("overcast,turbidity=4", "neither sun"),
            ("studio,elevation=4", "neither sun"),
            ("latitude=1,longitude=2", "belong together"),
            ("sunrise,latitude=1,longitude=2,date=2026-01-01,time=10:00", "exclude"),
            ("latitude=50,longitude=0,date=2026-06-21,time=00:00", "below the horizon"),
            ("latitude=50,longitude=0,date=2026-02-30,time=12:00", "no date"),
            ("latitude=50,longitude=0,date=2026-02-03,time=25:00", "time=HH:MM"),
        ] {
            let said = bad.parse::<SunOption>().unwrap_err();
            assert!(said.contains(why), "{bad}: {said}");
        }
    }
}
