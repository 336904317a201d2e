//! The columns of Relightable3DGaussian (Gao et al. 2023): material before its activation.
//!
//! `base_color = 0.77 sigmoid(v) + 0.03`, `roughness = 0.9 sigmoid(v) + 0.09`, both linear. The
//! visibility is 0.5 + SH, one channel; `incidents` are SH of the local light, RGB. It has no
//! metals. Ours ([`Materials`]) are the activated values, under the same names.

use motes_scene::{ColumnValues, ExtraColumn, Gaussians, Materials};

use motes_formats::ply::SH_C0;

/// Coefficients beyond degree 0 of the incident light (degree 3) and of the visibility (degree 4)
/// as the reference implementation sizes them.
const INCIDENTS_REST: usize = 45;
const VISIBILITY_REST: usize = 24;

const BASE_COLOR: [f32; 2] = [0.77, 0.03];
const ROUGHNESS: [f32; 2] = [0.9, 0.09];

fn activated(value: f32, [range, low]: [f32; 2]) -> f32 {
    range / (1.0 + (-value).exp()) + low
}

/// The inverse; values out of range become the nearest that a logit of ±8 reaches.
fn before_activation(value: f32, [range, low]: [f32; 2]) -> f32 {
    let share = ((value - low) / range).clamp(3.353_501_3e-4, 1.0 - 3.353_501_3e-4);
    (share / (1.0 - share)).ln()
}

fn floats<'g>(gaussians: &'g Gaussians, name: &str) -> Option<&'g Vec<f32>> {
    gaussians.extra.iter().find(|column| column.name == name).and_then(|c| match &c.values {
        ColumnValues::F32(values) => Some(values),
        _ => None,
    })
}

/// Whether the columns are R3DG's, whose materials are not activated.
pub(crate) fn is_r3dg(gaussians: &Gaussians) -> bool {
    floats(gaussians, "incidents_dc_0").is_some()
        && floats(gaussians, "base_color_0").is_some()
        && gaussians.extra.iter().all(|column| column.name != "metallic")
}

/// Turns R3DG's columns into [`Materials`]; those of visibility and incident light stay as they are.
pub(crate) fn activate(gaussians: &mut Gaussians) {
    let n = gaussians.len();
    let column = |name: &str| floats(gaussians, name).cloned();
    let triple = |names: [&str; 3]| -> Option<Vec<[f32; 3]>> {
        let [x, y, z] = names.map(column);
        let (x, y, z) = (x?, y?, z?);
        Some((0..n).map(|i| [x[i], y[i], z[i]]).collect())
    };
    let (Some(base), Some(roughness)) =
        (triple(["base_color_0", "base_color_1", "base_color_2"]), column("roughness"))
    else {
        return;
    };
    let normals = triple(["nx", "ny", "nz"]).unwrap_or_else(|| vec![[0.0; 3]; n]);
    let visibility = column("visibility_dc_0").unwrap_or_else(|| vec![0.5 / SH_C0; n]);
    let unit = |v: [f32; 3]| {
        let norm = v.iter().map(|c| c * c).sum::<f32>().sqrt();
        if norm > 0.0 { v.map(|c| c / norm) } else { v }
    };
    let materials = Materials {
        normals: normals.into_iter().map(unit).collect(),
        base_color_linear: base.iter().map(|c| c.map(|v| activated(v, BASE_COLOR))).collect(),
        roughness: roughness.iter().map(|v| activated(*v, ROUGHNESS)).collect(),
        metallic: vec![0.0; n],
        visibility: visibility.iter().map(|v| (0.5 + SH_C0 * v).clamp(0.0, 1.0)).collect(),
        // The file does not say; 0 would mean that the material is a guess.
        observations: vec![1; n],
    };
    materials.attach(gaussians);
}

/// The same Gaussians with R3DG's columns instead of [`Materials`].
///
/// # Errors
/// The name of the first material column that is missing.
pub(crate) fn deactivated(gaussians: &Gaussians) -> Result<Gaussians, &'static str> {
    let materials = Materials::of(gaussians)?;
    let n = gaussians.len();
    let mut extra = Vec::new();
    let mut push = |name: String, values: Vec<f32>| {
        extra.push(ExtraColumn { name, values: ColumnValues::F32(values) });
    };
    let axis = |of: &[[f32; 3]], k: usize| of.iter().map(|v| v[k]).collect::<Vec<f32>>();
    for (k, name) in ["nx", "ny", "nz"].into_iter().enumerate() {
        push(name.into(), axis(&materials.normals, k));
    }
    for k in 0..3 {
        let values = axis(&materials.base_color_linear, k);
        let values = values.iter().map(|v| before_activation(*v, BASE_COLOR)).collect();
        push(format!("base_color_{k}"), values);
    }
    let values = materials.roughness.iter().map(|v| before_activation(*v, ROUGHNESS)).collect();
    push("roughness".into(), values);
    // What came from R3DG is kept; otherwise no local light, and a visibility without direction.
    let kept = |name: &str| floats(gaussians, name).cloned();
    for (group, rest) in [("incidents", INCIDENTS_REST), ("visibility", VISIBILITY_REST)] {
        let channels = if group == "incidents" { 3 } else { 1 };
        for k in 0..channels {
            let name = format!("{group}_dc_{k}");
            let constant = || match group {
                "visibility" => materials.visibility.iter().map(|v| (v - 0.5) / SH_C0).collect(),
                _ => vec![0.0; n],
            };
            let values = kept(&name).unwrap_or_else(constant);
            push(name, values);
        }
        for k in 0..rest {
            let name = format!("{group}_rest_{k}");
            let values = kept(&name).unwrap_or_else(|| vec![0.0; n]);
            push(name, values);
        }
    }
    Ok(Gaussians { extra, ..gaussians.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_come_back_within_the_range_of_the_activations() {
        let mut gaussians = Gaussians { means: vec![[0.0; 3]; 2], ..Gaussians::empty(0) };
        let materials = Materials {
            normals: vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
            base_color_linear: vec![[0.1, 0.5, 0.75], [0.0, 1.0, 0.4]],
            roughness: vec![0.2, 0.9],
            metallic: vec![0.0; 2],
            visibility: vec![1.0, 0.25],
            observations: vec![1; 2],
        };
        materials.attach(&mut gaussians);
        let mut other = deactivated(&gaussians).unwrap();
        assert!(is_r3dg(&other) && !is_r3dg(&gaussians));
        assert_eq!(other.extra.len(), 3 + 3 + 1 + 3 + 45 + 1 + 24);
        activate(&mut other);
        let back = Materials::of(&other).unwrap();
        let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
        assert!((0..3).all(|k| near(back.base_color_linear[0][k], [0.1, 0.5, 0.75][k])));
        assert!(near(back.roughness[1], 0.9) && near(back.visibility[1], 0.25));
        // Out of the range of R3DG: the nearest that it can say.
        assert!((back.base_color_linear[1][0] - 0.03).abs() < 5e-4);
        assert!((back.base_color_linear[1][1] - 0.80).abs() < 5e-4);
        assert!(!is_r3dg(&other), "activated twice");
    }
}
