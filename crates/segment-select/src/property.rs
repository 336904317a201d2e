//! Values of Gaussians by name.

use motes_math::sigmoid::sigmoid;
use motes_scene::{ColumnValues, Gaussians};

use crate::color::lab_from_srgb;
use crate::error::SelectError;

/// L*a*b* of a Gaussian's color without its dependence on direction.
pub(crate) fn base_lab(gaussians: &Gaussians, i: usize) -> [f32; 3] {
    lab_from_srgb(gaussians.mean_color(i))
}

/// Names that are not columns of the file.
const NAMES: [&str; 16] = [
    "x",
    "y",
    "z",
    "scale",
    "scale_min",
    "scale_max",
    "scale_0",
    "scale_1",
    "scale_2",
    "opacity",
    "red",
    "green",
    "blue",
    "rot_0..3",
    "f_dc_0..2",
    "f_rest_0..",
];

/// The values of a property, `[N]`. With `_raw` at the end of the name as they are stored: logarithms of
/// scales, logits of opacities, coefficients of colors.
///
/// # Errors
/// When there is no such property.
pub fn property(gaussians: &Gaussians, name: &str) -> Result<Vec<f64>, SelectError> {
    let (bare, raw) = match name.strip_suffix("_raw") {
        Some(bare) => (bare, true),
        None => (name, false),
    };
    let n = gaussians.len();
    let of = |f: &dyn Fn(usize) -> f32| (0..n).map(|i| f64::from(f(i))).collect();
    let scale = |s: f32| if raw { s } else { s.exp() };
    let scales = &gaussians.log_scales;
    let rest = gaussians.sh_coefficients() - 1;
    Ok(match bare {
        "x" => of(&|i| gaussians.means[i][0]),
        "y" => of(&|i| gaussians.means[i][1]),
        "z" => of(&|i| gaussians.means[i][2]),
        "scale" => of(&|i| scale(scales[i].iter().sum::<f32>() / 3.0)),
        "scale_min" => of(&|i| scale(scales[i].iter().copied().fold(f32::INFINITY, f32::min))),
        "scale_max" => of(&|i| scale(scales[i].iter().copied().fold(f32::NEG_INFINITY, f32::max))),
        "scale_0" => of(&|i| scale(scales[i][0])),
        "scale_1" => of(&|i| scale(scales[i][1])),
        "scale_2" => of(&|i| scale(scales[i][2])),
        "opacity" => of(&|i| {
            let logit = gaussians.opacity_logits[i];
            if raw { logit } else { sigmoid(logit) }
        }),
        "red" | "green" | "blue" => {
            let k = usize::from(bare == "green") + 2 * usize::from(bare == "blue");
            of(&|i| if raw { gaussians.sh_of(i)[k] } else { gaussians.mean_color(i)[k] })
        }
        _ if numbered(bare, "rot_").is_some_and(|k| k < 4) => {
            let k = numbered(bare, "rot_").unwrap_or(0);
            of(&|i| {
                let q = gaussians.rotations[i];
                let length = q.iter().map(|v| v * v).sum::<f32>().sqrt();
                if raw { q[k] } else { q[k] / length }
            })
        }
        _ if numbered(bare, "f_dc_").is_some_and(|k| k < 3) => {
            let k = numbered(bare, "f_dc_").unwrap_or(0);
            of(&|i| if raw { gaussians.sh_of(i)[k] } else { gaussians.mean_color(i)[k] })
        }
        _ if numbered(bare, "f_rest_").is_some_and(|k| k < 3 * rest) => {
            // The file has all coefficients of red, then of green, then of blue.
            let k = numbered(bare, "f_rest_").unwrap_or(0);
            of(&|i| gaussians.sh_of(i)[3 * (1 + k % rest) + k / rest])
        }
        _ => {
            let column = |name: &str| gaussians.extra.iter().find(|c| c.name == name);
            let found = column(name).or_else(|| column(bare));
            let Some(column) = found else {
                let extra = gaussians.extra.iter().map(|c| c.name.as_str());
                let known: Vec<&str> =
                    NAMES.into_iter().chain(["visibility_count"]).chain(extra).collect();
                let (name, known) = (name.to_owned(), known.join(", "));
                return Err(SelectError::NoSuchProperty { name, known });
            };
            values(&column.values)
        }
    })
}

/// The number at the end of `name`, after `prefix`.
fn numbered(name: &str, prefix: &str) -> Option<usize> {
    name.strip_prefix(prefix).and_then(|digits| digits.parse().ok())
}

fn values(column: &ColumnValues) -> Vec<f64> {
    match column {
        ColumnValues::I8(v) => v.iter().map(|&x| f64::from(x)).collect(),
        ColumnValues::U8(v) => v.iter().map(|&x| f64::from(x)).collect(),
        ColumnValues::I16(v) => v.iter().map(|&x| f64::from(x)).collect(),
        ColumnValues::U16(v) => v.iter().map(|&x| f64::from(x)).collect(),
        ColumnValues::I32(v) => v.iter().map(|&x| f64::from(x)).collect(),
        ColumnValues::U32(v) => v.iter().map(|&x| f64::from(x)).collect(),
        ColumnValues::F32(v) => v.iter().map(|&x| f64::from(x)).collect(),
        ColumnValues::F64(v) => v.clone(),
    }
}

#[cfg(test)]
mod tests {
    use motes_scene::ExtraColumn;

    use super::*;

    #[test]
    fn values_come_stored_and_meant() {
        let mut g = motes_testkit::random_gaussians(2, 4, 1);
        g.extra.push(ExtraColumn {
            name: "part".into(),
            values: ColumnValues::I16(vec![-3, 1, 2, 3]),
        });
        let get = |name: &str| property(&g, name).unwrap();
        assert_eq!(get("y")[2], f64::from(g.means[2][1]));
        assert_eq!(get("opacity_raw")[1], f64::from(g.opacity_logits[1]));
        assert!((get("opacity")[1] - 1.0 / (1.0 + (-get("opacity_raw")[1]).exp())).abs() < 1e-6);
        assert!((get("scale_max")[0].ln() - get("scale_max_raw")[0]).abs() < 1e-5);
        assert!((get("red")[3] - (0.5 + 0.282_094_8 * get("red_raw")[3])).abs() < 1e-6);
        assert_eq!(get("part")[0], -3.0);
        assert_eq!(get("f_dc_2_raw"), get("blue_raw"));
        // Degree 1 has 3 coefficients per channel beyond the mean: number 4 is the second of green.
        assert_eq!(get("f_rest_4")[3], f64::from(g.sh_of(3)[3 * 2 + 1]));
        let norm: f64 = (0..4).map(|k| get(&format!("rot_{k}"))[1].powi(2)).sum();
        assert!((norm - 1.0).abs() < 1e-6);
        for none in ["rot_4", "f_dc_3", "f_rest_9", "f_rest_"] {
            assert!(property(&g, none).is_err(), "{none}");
        }
        let error = property(&g, "partt").unwrap_err().to_string();
        assert!(
            error.contains("partt") && error.contains("part,") || error.contains("part"),
            "{error}"
        );
    }
}
