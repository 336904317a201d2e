//! Which column of a PLY file becomes which value of [`motes_scene::Gaussians`].

use std::collections::BTreeSet;
use std::path::Path;

use super::header::{Element, Header, PropertyKind};
use super::rows::{Field, fields, packed_row_bytes};
use super::scalar::Scalar;
use crate::error::{FormatError, Result, quoted};

/// Numbers of `f_rest` columns and the SH degree each belongs to.
const F_REST_COUNTS: [(usize, u8); 5] = [(0, 0), (9, 1), (24, 2), (45, 3), (72, 4)];

pub(super) struct Plan {
    pub(super) row_bytes: usize,
    pub(super) means: [Field; 3],
    pub(super) rotations: [Field; 4],
    pub(super) log_scales: [Field; 2],
    /// Absent in files of flat Gaussians (2DGS).
    pub(super) third_log_scale: Option<Field>,
    pub(super) opacity_logit: Field,
    /// In the order of [`motes_scene::Gaussians::sh`]: coefficient-major, RGB fastest.
    pub(super) sh: Vec<Field>,
    pub(super) sh_degree: u8,
    /// Where the columns of `sh` behind the first three begin, when they are as most programs write them.
    pub(super) f_rest_offset: Option<usize>,
    /// Set when the first three of `sh` are `red green blue` instead of coefficients.
    pub(super) color_scale: Option<f32>,
    pub(super) extra: Vec<(String, Field)>,
}

impl Plan {
    pub(super) fn new(header: &Header, element: &Element, path: &Path) -> Result<Self> {
        let columns: Vec<(&str, Field)> = fields(element).collect();
        let mut used = BTreeSet::new();
        let place = format!("ply header line {}", element.line);
        let mut take = |name: &str| {
            let found = columns.iter().find(|(column, _)| *column == name)?;
            used.insert(name.to_owned());
            Some(found.1)
        };
        let missing = |name: &str| missing_property(header, element, path, &place, name);
        let mut require = |name: &str| take(name).ok_or_else(|| missing(name));

        let means = [require("x")?, require("y")?, require("z")?];
        let opacity_logit = require("opacity")?;
        let log_scales = [require("scale_0")?, require("scale_1")?];
        let rotations =
            [require("rot_0")?, require("rot_1")?, require("rot_2")?, require("rot_3")?];
        let third_log_scale = take("scale_2");

        let mut color_scale = None;
        let dc = match ["f_dc_0", "f_dc_1", "f_dc_2"].map(&mut take) {
            [Some(r), Some(g), Some(b)] => [r, g, b],
            [None, None, None] => match ["red", "green", "blue"].map(&mut take) {
                [Some(r), Some(g), Some(b)] => {
                    color_scale = Some(1.0 / full_scale(r.scalar));
                    [r, g, b]
                }
                _ => return Err(missing("f_dc_0")),
            },
            found => {
                let first = found.iter().position(Option::is_none).unwrap_or_default();
                return Err(missing(&format!("f_dc_{first}")));
            }
        };
        let rest_count = columns.iter().filter(|(name, _)| is_f_rest(name)).count();
        let Some(&(_, sh_degree)) = F_REST_COUNTS.iter().find(|(n, _)| *n == rest_count) else {
            let cause = format!(
                "{rest_count} f_rest columns belong to no SH degree (0, 9, 24, 45 and 72 do)"
            );
            return Err(FormatError::invalid(path, place.clone(), cause));
        };
        let mut sh = dc.to_vec();
        // The file holds all of red first, then green, then blue.
        let per_channel = rest_count / 3;
        for k in 0..per_channel {
            for channel in 0..3 {
                let name = format!("f_rest_{}", channel * per_channel + k);
                sh.push(take(&name).ok_or_else(|| missing(&name))?);
            }
        }
        let extra = columns
            .iter()
            .filter(|(name, _)| !used.contains(*name))
            .map(|(name, field)| ((*name).to_owned(), *field))
            .collect();
        let row_bytes = packed_row_bytes(element);
        Ok(Self {
            row_bytes,
            means,
            rotations,
            log_scales,
            third_log_scale,
            opacity_logit,
            f_rest_offset: f_rest_offset(&sh),
            sh,
            sh_degree,
            color_scale,
            extra,
        })
    }

    /// Whether all but the extra columns are of single precision.
    pub(super) fn is_all_f32(&self) -> bool {
        let standard = self.means.iter().chain(&self.rotations).chain(&self.log_scales);
        let standard = standard.chain([&self.opacity_logit]).chain(&self.third_log_scale);
        standard.chain(&self.sh).all(|field| field.scalar == Scalar::F32)
    }
}

/// Where the `f_rest` columns begin, when they follow one another in the order of their numbers: `sh` holds
/// all coefficients, RGB fastest.
fn f_rest_offset(sh: &[Field]) -> Option<usize> {
    let (first, per_channel) = (sh.get(3)?.offset, sh.len() / 3 - 1);
    let in_order = sh[3..].iter().enumerate().all(|(i, field)| {
        let number = (i % 3) * per_channel + i / 3;
        field.scalar == Scalar::F32 && field.offset == first + 4 * number
    });
    in_order.then_some(first)
}

fn is_f_rest(name: &str) -> bool {
    name.strip_prefix("f_rest_")
        .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
}

/// The value that stands for a channel at full intensity.
pub(super) fn full_scale(scalar: Scalar) -> f32 {
    match scalar {
        Scalar::F16 | Scalar::F32 | Scalar::F64 => 1.0,
        Scalar::U16 => 65535.0,
        _ => 255.0,
    }
}

fn missing_property(
    header: &Header,
    element: &Element,
    path: &Path,
    place: &str,
    name: &str,
) -> FormatError {
    let list = element.property(name).filter(|p| matches!(p.kind, PropertyKind::List { .. }));
    let (place, cause) = match list {
        Some(property) => (
            format!("ply header line {}", property.line),
            format!("property {} is a list", quoted(name)),
        ),
        None => (place.to_owned(), format!("property {} is missing", quoted(name))),
    };
    let error = FormatError::invalid(path, place, cause);
    if header.elements.iter().any(|e| e.name == "face") {
        error.with_remedy("this looks like a mesh, not like Gaussians")
    } else if ["opacity", "scale_0", "rot_0"].iter().all(|n| element.property(n).is_none()) {
        error.with_remedy("this looks like a point cloud, not like Gaussians")
    } else {
        error
    }
}
