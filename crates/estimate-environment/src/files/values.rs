//! Values of flags.

use std::str::FromStr;

use glam::{DVec3, Vec3};
use serde::{Serialize, Serializer};

use crate::mirror_ball::Outline;

/// A place: a point of the world, or what a pixel of a view shows.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum At {
    /// World units.
    Point(DVec3),
    /// Name of a view of the capture, and a pixel.
    Pixel(String, [f64; 2]),
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|t| t.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect()
}

impl FromStr for At {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(&[x, y, z]) = numbers(text).as_deref() {
            return Ok(Self::Point(DVec3::new(x, y, z)));
        }
        let mut parts = text.rsplitn(3, ',');
        let (y, x, view) = (parts.next(), parts.next(), parts.next());
        match (view, x.and_then(numbers).as_deref(), y.and_then(numbers).as_deref()) {
            (Some(view), Some(&[x]), Some(&[y])) if !view.is_empty() => {
                Ok(Self::Pixel(view.into(), [x, y]))
            }
            _ => Err("expected X,Y,Z or VIEW,X,Y".into()),
        }
    }
}

impl Serialize for At {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Point(p) => serializer.collect_str(&format_args!("{},{},{}", p.x, p.y, p.z)),
            Self::Pixel(view, [x, y]) => serializer.collect_str(&format_args!("{view},{x},{y}")),
        }
    }
}

/// A direction.
pub(super) fn direction(text: &str) -> Result<String, String> {
    vector(text).map(|_| text.to_owned())
}

/// A unit vector of a checked text.
pub(super) fn vector(text: &str) -> Result<DVec3, String> {
    let found = match numbers(text).as_deref() {
        Some(&[x, y, z]) => DVec3::new(x, y, z).try_normalize(),
        _ => None,
    };
    found.ok_or_else(|| "expected a direction X,Y,Z, not 0".into())
}

/// Reflectance of a ball: one number, or three.
pub(super) fn reflectance(text: &str) -> Result<String, String> {
    rgb(text).map(|_| text.to_owned())
}

/// RGB of a checked text.
pub(super) fn rgb(text: &str) -> Result<Vec3, String> {
    let found = match numbers(text).as_deref() {
        Some(&[v]) => Some([v; 3]),
        Some(&[r, g, b]) => Some([r, g, b]),
        _ => None,
    };
    let in_range = |rgb: &[f64; 3]| rgb.iter().all(|v| (0.01..=1.0).contains(v));
    let found = found.filter(in_range).map(|rgb| Vec3::from(rgb.map(|v| v as f32)));
    found.ok_or_else(|| "expected a reflectance from 0.01 to 1, or R,G,B".into())
}

/// The outline of a ball.
pub(super) fn outline(text: &str) -> Result<String, String> {
    circle(text).map(|_| text.to_owned())
}

/// The outline of a checked text.
pub(super) fn circle(text: &str) -> Result<Outline, String> {
    match numbers(text).as_deref() {
        Some(&[x, y, radius]) if radius > 0.0 => Ok(Outline { center: [x, y], radius }),
        _ => Err("expected CX,CY,R in pixels, R above 0".into()),
    }
}

/// A number above a bound.
pub(super) fn above(bound: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let value = text.parse().ok().filter(|v: &f64| *v > bound && v.is_finite());
        value.ok_or_else(|| format!("expected a number above {bound}"))
    }
}

/// An exposure time: seconds, or a fraction such as 1/250.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let value = match text.split_once('/') {
        Some((a, b)) => {
            a.trim().parse::<f64>().ok().zip(b.trim().parse::<f64>().ok()).map(|(a, b)| a / b)
        }
        None => text.trim().parse().ok(),
    };
    let value = value.filter(|v: &f64| *v > 0.0 && v.is_finite());
    value.ok_or_else(|| "expected seconds above 0, such as 0.5 or 1/250".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_mistakes_refused() {
        assert_eq!("1,-2,3e0".parse(), Ok(At::Point(DVec3::new(1.0, -2.0, 3.0))));
        assert_eq!("a,b.jpg,10,20.5".parse(), Ok(At::Pixel("a,b.jpg".into(), [10.0, 20.5])));
        for bad in ["", "1,2", "1,2,NaN,", "v,1,inf", ",1,2"] {
            assert!(bad.parse::<At>().is_err(), "{bad}");
        }
        assert_eq!(seconds("1/250"), Ok(0.004));
        assert!(seconds("1/0").is_err() && seconds("-1").is_err() && seconds("x").is_err());
        assert_eq!(rgb("0.5"), Ok(Vec3::splat(0.5)));
        assert!(rgb("0").is_err() && rgb("1,2").is_err() && rgb("2").is_err());
        assert!(circle("1,2,0").is_err() && circle("5,6,7").is_ok());
        assert!(vector("0,0,0").is_err());
        assert!(above(1.0)("1").is_err() && above(1.0)("1.5") == Ok(1.5));
    }
}
