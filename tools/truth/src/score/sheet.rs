//! Contact sheets: truth, ours and error, for every light and view.

use std::path::Path;

use glam::Vec3;
use motes_figures::contact_sheet::{ContactCell, ContactRow, ContactSheet};
use motes_figures::error_map::error_map;
use motes_scene::{ImageF32, ImageU8};

use super::align::Align;
use super::materials::Prediction;
use super::truth_folder::TruthFolder;
use super::{Results, Scores, pictures};
use crate::photos::encode;

/// Width of a picture on the sheet, pixels.
const CELL: usize = 240;

/// Pictures: a row per view, three columns per light, aligned by channel.
///
/// # Errors
/// When a picture is missing.
pub fn relit(truth: &TruthFolder, results: &Results, scores: &Scores) -> anyhow::Result<ImageU8> {
    let mut sheet = ContactSheet {
        title: format!("{}: truth, ours (one factor per channel), error", truth.title),
        ..ContactSheet::default()
    };
    let lights = results
        .relit
        .iter()
        .map(|(name, folder)| (format!("relight_{name}"), folder, scores.relit.get(name)));
    let own = results
        .capture
        .iter()
        .map(|folder| ("capture".to_owned(), folder, scores.capture.as_ref()));
    let columns: Vec<_> = own.chain(lights).collect();
    for (name, ..) in &columns {
        sheet.columns.extend([name.clone(), "ours".into(), "error".into()]);
    }
    for view in &truth.views {
        let mut row = ContactRow { label: vec![view.clone()], cells: Vec::new() };
        for (what, folder, scores) in &columns {
            let real = truth.picture(&truth.root.join("test").join(what), view)?;
            let aligned = scores.and_then(|s| s.aligned.get(&Align::Channel));
            let factors = aligned.map_or([1.0; 3], |a| a.factors);
            let ours = pictures::ours(truth, Path::new(folder), view)?;
            let ours = pictures::scaled(&ours.data, factors);
            let ours = ImageU8::from_data(real.width, real.height, 3, ours);
            let error = error_map(&real, &ours, None);
            let db = |a: Align| {
                let row = scores.and_then(|s| s.aligned.get(&a))?;
                row.views_psnr_db.get(view).copied()
            };
            let number = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.2}"));
            let caption =
                format!("{} dB, raw {}", number(db(Align::Channel)), number(db(Align::None)));
            for (image, caption) in [(real, String::new()), (ours, caption), (error, String::new())]
            {
                row.cells.push(Some(ContactCell { image, caption }));
            }
        }
        sheet.rows.push(row);
    }
    Ok(sheet.draw(CELL))
}

/// Components: a row per view, truth and ours of every buffer.
///
/// # Errors
/// When a buffer is missing.
pub fn components(truth: &TruthFolder, folder: &Path) -> anyhow::Result<ImageU8> {
    let mut sheet = ContactSheet {
        title: format!("{}: components, truth and ours as delivered", truth.title),
        ..ContactSheet::default()
    };
    for name in ["base color", "normal", "roughness", "metallic"] {
        sheet.columns.extend([name.into(), "ours".into()]);
    }
    for view in &truth.views {
        let (real, ours) = (truth.buffers(view)?, Prediction::read(truth, view, folder)?);
        let cell = |image: ImageU8| Some(ContactCell { image, caption: String::new() });
        let cells = vec![
            cell(color(&real.albedo)),
            cell(color(&ours.base_color)),
            cell(direction(&real.normal)),
            cell(direction(&ours.normal)),
            cell(real.roughness.to_u8()),
            cell(ours.roughness.to_u8()),
            cell(real.metallic.to_u8()),
            cell(ours.metallic.to_u8()),
        ];
        sheet.rows.push(ContactRow { label: vec![view.clone()], cells });
    }
    Ok(sheet.draw(CELL))
}

fn color(linear: &ImageF32) -> ImageU8 {
    let data = linear.data.iter().map(|&v| encode(v)).collect();
    ImageU8::from_data(linear.width, linear.height, 3, data)
}

fn direction(normal: &ImageF32) -> ImageU8 {
    let pixel = |n: &[f32]| {
        let n = Vec3::from_slice(n).normalize_or_zero();
        if n == Vec3::ZERO { [0; 3] } else { (n * 0.5 + 0.5).to_array().map(|v| (v * 255.0) as u8) }
    };
    let data = normal.data.chunks_exact(3).flat_map(pixel).collect();
    ImageU8::from_data(normal.width, normal.height, 3, data)
}
