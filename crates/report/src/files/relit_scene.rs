//! Reading what the page of a relit scene shows: a scene folder, its pictures in every light, run
//! records.

use std::path::{Path, PathBuf};

use motes_formats::capture::read_capture;
use motes_formats::decomposition::{DecompositionDocument, read_decomposition};
use motes_formats::documents::read_document;
use motes_formats::environment::read_environment;
use motes_formats::exr_aov::{AovImage, open_exr};
use motes_formats::images::read_image;
use motes_formats::run_record::RunRecord;
use motes_formats::{FormatError, Result};
use motes_math::metrics::psnr_f32;
use motes_scene::{Convention, ImageF32, ImageU8, Split};

use crate::pages::{RelightPage, RelightStep, RelightTerm, RelightView};
use evaluate::files::photos::load_photo;
use evaluate::score::{PSNR_CAP_DB, Photo};
use render::frames::view_stems;

/// Where everything is.
#[derive(Clone, Debug, Default)]
pub(super) struct RelightFiles {
    /// Scene folder.
    pub(super) scene: PathBuf,
    /// Capture whose held-out views were drawn.
    pub(super) capture: PathBuf,
    /// Pictures under the capture illumination; with EXR files beside them, components too.
    pub(super) own: PathBuf,
    /// Names and pictures of other lights.
    pub(super) lights: Vec<(String, PathBuf)>,
    /// Run records, in the order of the table.
    pub(super) runs: Vec<PathBuf>,
}

/// Reads the contents of the page.
///
/// # Errors
/// When a file is missing or malformed, or a picture has another size than its view.
pub(super) fn load_relight(files: &RelightFiles) -> Result<RelightPage> {
    let scene = read_decomposition(&files.scene)?;
    let document = &scene.document;
    let mut page = RelightPage {
        lights: files.lights.iter().map(|(name, _)| name.clone()).collect(),
        terms: document.terms.iter().map(term).collect(),
        scale_anchor: format!("Scale of the light: {}", document.scale_anchor.explanation),
        facts: facts(document),
        steps: files.runs.iter().map(|path| step(path)).collect::<Result<_>>()?,
        ..RelightPage::default()
    };
    let light = read_environment(&scene.environment)?;
    let picture = encoded(&light);
    page.environment = Some((picture, axes(document)));

    let capture = read_capture(&files.capture)?;
    let stems = view_stems(&capture);
    for index in capture.views_of(Split::Test) {
        let stem = &stems[index];
        let photo = load_photo(&files.capture, &capture, index, [0.0; 3])?;
        let size = (photo.rgb.width, photo.rgb.height);
        let read = |folder: &Path| -> Result<ImageU8> {
            let path = folder.join(format!("{stem}.png"));
            let image = rgb(read_image(&path)?);
            if (image.width, image.height) != size {
                let cause = format!(
                    "{} x {} pixels, its photo has {} x {}",
                    image.width, image.height, size.0, size.1
                );
                return Err(FormatError::invalid(&path, "size", cause));
            }
            Ok(image)
        };
        let own = read(&files.own)?;
        let psnr = psnr(&photo, &own);
        let relit = files.lights.iter().map(|(_, folder)| read(folder).map(Some));
        let exr = files.own.join(format!("{stem}.exr"));
        page.views.push(RelightView {
            name: capture.views[index].name.clone(),
            own_psnr_db: psnr,
            own: Some(own),
            relit: relit.collect::<Result<_>>()?,
            components: if exr.exists() { components(&open_exr(&exr)?) } else { Vec::new() },
            photo: Some(photo.rgb),
        });
    }
    Ok(page)
}

/// Of the pixels that count, dB; none when no pixel does.
fn psnr(photo: &Photo, picture: &ImageU8) -> Option<f64> {
    let counts = |i: &usize| photo.counted.as_ref().is_none_or(|c| c[*i]);
    let pixels: Vec<usize> = (0..picture.pixel_count()).filter(counts).collect();
    let values = |image: &ImageU8| -> Vec<f32> {
        let of = |&i: &usize| (0..3).map(move |c| f32::from(image.data[3 * i + c]) / 255.0);
        pixels.iter().flat_map(of).collect()
    };
    let psnr = psnr_f32(&values(&rgb(photo.rgb.clone())), &values(picture));
    (!pixels.is_empty()).then(|| psnr.min(PSNR_CAP_DB))
}

fn term(term: &motes_formats::decomposition::TermDocument) -> RelightTerm {
    RelightTerm { name: term.name.clone(), kept: term.kept, evidence: term.evidence.clone() }
}

fn facts(document: &DecompositionDocument) -> Vec<(String, String)> {
    let c = &document.counts;
    let pair = |name: &str, value: String| (name.to_owned(), value);
    vec![
        pair("lobes", format!("{:?}", document.lobes).to_lowercase()),
        pair("indirect light", if document.indirect { "one bounce" } else { "none" }.into()),
        pair(
            "Gaussians",
            format!("{}, of which no photo saw {}", c.gaussians, c.unobserved_gaussians),
        ),
        pair("surface", format!("{} vertices, {} triangles", c.vertices, c.triangles)),
    ]
}

fn axes(document: &DecompositionDocument) -> String {
    let own = match document.environment_convention {
        Convention::OpenExr => "up is +y, the center +z",
        Convention::Blender => "up is +z, the center +x",
        Convention::ThreeJs => "up is +y, the center +x",
    };
    match document.environment_up_in_world {
        None => own.into(),
        Some([x, y, z]) => {
            format!("{own}, turned so that up is ({x:.2}, {y:.2}, {z:.2}) in the world")
        }
    }
}

fn step(path: &Path) -> Result<RelightStep> {
    let record = read_document::<RunRecord>(path)?.document;
    let product = record.outputs.first().map_or("", String::as_str);
    let product = Path::new(product).file_name().unwrap_or_default().to_string_lossy();
    let tool = record.tool.strip_prefix("motes ").unwrap_or(&record.tool);
    Ok(RelightStep {
        name: format!("{tool}: {product}"),
        cpu_seconds: record.cpu_s,
        seconds: record.wall_s,
        peak_memory_bytes: record.peak_memory_bytes,
    })
}

fn rgb(image: ImageU8) -> ImageU8 {
    if image.channels == 3 {
        return image;
    }
    let data = image.data.chunks_exact(image.channels).flat_map(|p| [p[0], p[1], p[2]]).collect();
    ImageU8::from_data(image.width, image.height, 3, data)
}

/// Linear values as sRGB (IEC 61966-2-1).
fn encoded(linear: &ImageF32) -> ImageU8 {
    let curve = |v: f32| motes_math::srgb::encode(v.max(0.0).clamp(0.0, 1.0));
    let pixels = linear.data.chunks_exact(linear.channels);
    let data = pixels.flat_map(|p| [0, 1, 2].map(|c| curve(p[c.min(p.len() - 1)]))).collect();
    ImageF32::from_data(linear.width, linear.height, 3, data).to_u8()
}

/// The buffers of a view as pictures; those that the file does not have are left out.
fn components(image: &AovImage) -> Vec<(String, ImageU8)> {
    let planes = |names: &[&str]| -> Option<ImageF32> {
        let planes: Vec<Vec<f32>> =
            names.iter().map(|n| image.channel(n).map(|c| c.to_f32())).collect::<Option<_>>()?;
        let n = image.width * image.height;
        let data = (0..n).flat_map(|i| planes.iter().map(move |p| p[i])).collect();
        Some(ImageF32::from_data(image.width, image.height, planes.len(), data))
    };
    let color = |layer: &str| {
        let names = ["R", "G", "B"].map(|c| format!("{layer}.{c}"));
        planes(&names.each_ref().map(String::as_str)).map(|p| encoded(&p))
    };
    let share = |layer: &str| {
        let name = format!("{layer}.V");
        planes(&[&name]).or_else(|| planes(&[layer])).map(|p| p.to_u8())
    };
    let normal = planes(&["normal.X", "normal.Y", "normal.Z"]).map(|p| {
        let data = p.data.iter().map(|v| 0.5 + 0.5 * v).collect();
        ImageF32::from_data(p.width, p.height, 3, data).to_u8()
    });
    let all = [
        ("base color", color("base_color")),
        ("normal", normal),
        ("roughness", share("roughness")),
        ("metallic", share("metallic")),
        ("visibility", share("visibility")),
        ("diffuse", color("diffuse")),
        ("specular", color("specular")),
        ("indirect", color("indirect")),
    ];
    all.into_iter().filter_map(|(name, p)| Some((name.to_owned(), p?))).collect()
}
