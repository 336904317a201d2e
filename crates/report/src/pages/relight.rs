//! The page of a relit scene: what the photos were taken apart into, and the scene under other
//! lights.

use motes_scene::ImageU8;

use motes_figures::contact_sheet::{ContactCell, ContactRow, ContactSheet};
use motes_figures::html::{Cell, Comparison, Layer, Link, Page, Table, jpeg_url};

/// Width of a picture on sheets, pixels.
const CELL: usize = 240;

/// A part of the image formation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RelightTerm {
    /// Such as `specular`.
    pub name: String,
    /// Whether it is part of the scene.
    pub kept: bool,
    /// Why, in a sentence.
    pub evidence: String,
}

/// A program that ran.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RelightStep {
    /// Its name and what it made.
    pub name: String,
    /// Processor seconds.
    pub cpu_seconds: Option<f64>,
    /// Elapsed seconds.
    pub seconds: f64,
    /// Largest resident size, bytes.
    pub peak_memory_bytes: Option<u64>,
}

/// One view in every light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RelightView {
    /// Name of the photo.
    pub name: String,
    /// The photo.
    pub photo: Option<ImageU8>,
    /// The scene under the light that was found with it.
    pub own: Option<ImageU8>,
    /// PSNR of `own` against the photo, dB.
    pub own_psnr_db: Option<f64>,
    /// Per light of the page, the picture.
    pub relit: Vec<Option<ImageU8>>,
    /// Names and pictures of components.
    pub components: Vec<(String, ImageU8)>,
}

/// Everything on the page.
#[derive(Clone, Debug, Default)]
pub struct RelightPage {
    /// Names of the lights.
    pub lights: Vec<String>,
    /// Views, each with as many pictures as there are lights.
    pub views: Vec<RelightView>,
    /// Kept and left out.
    pub terms: Vec<RelightTerm>,
    /// What the scale of light against base color rests on.
    pub scale_anchor: String,
    /// The light that was found, as a picture, and what its axes are.
    pub environment: Option<(ImageU8, String)>,
    /// Names and values of the scene: lobes, sizes.
    pub facts: Vec<(String, String)>,
    /// What ran and how long it took.
    pub steps: Vec<RelightStep>,
    /// Interactive pages of the scene.
    pub links: Vec<Link>,
    /// How it was made.
    pub protocol: Vec<(String, String)>,
}

impl RelightPage {
    /// Mean PSNR of the pictures under the capture illumination, dB.
    pub fn own_psnr_db(&self) -> Option<f64> {
        let all: Vec<f64> = self.views.iter().filter_map(|v| v.own_psnr_db).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    }

    /// The document.
    pub fn to_html(&self) -> String {
        let mut page = Page::new("The same scene in another light", &self.lead());
        page.heading("Before and after");
        page.paragraph(
            "Choose a light below each view; the slider, or dragging on the picture, uncovers the photo \
             from the left. Shadows and highlights should move with the light, the color of things \
             should not.",
        );
        page.comparisons(&self.views.iter().map(|v| self.comparison(v)).collect::<Vec<_>>());
        if !self.links.is_empty() {
            page.heading("Fly through the scene");
            page.links(&self.links);
        }
        if self.views.iter().any(|v| !v.components.is_empty()) {
            page.heading("What the photos were taken apart into");
            let widest = self.views.iter().flat_map(|v| &v.components).map(|(_, p)| p.width).max();
            let sheet = self.component_sheet().draw(widest.unwrap_or(CELL).min(CELL));
            page.picture(
                &jpeg_url(&sheet),
                "Photo, base color, normal, roughness, metallic and light of every view",
                "Base color as sRGB; normals in world, x y z from -1 to 1 as red, green and blue; roughness, \
                 metallic and visibility from 0 (black) to 1 (white).",
            );
        }
        if let Some((picture, axes)) = &self.environment {
            page.picture(
                &jpeg_url(picture),
                "Environment map",
                &format!("The light that was found, in the exposure of the photos; {axes}."),
            );
        }
        page.heading("What was kept and what was left out");
        page.table(&self.term_table());
        page.paragraph(&self.scale_anchor);
        page.definitions(&self.facts);
        page.heading("What it cost");
        page.table(&self.step_table());
        if !self.protocol.is_empty() {
            page.heading("How this was made");
            page.definitions(&self.protocol);
        }
        page.finish()
    }

    /// Photo, the capture illumination, and every other light: a row per view.
    pub fn to_contact_sheet(&self) -> ContactSheet {
        let columns = ["photo", "captured"].map(str::to_owned).into_iter();
        let row = |view: &RelightView| {
            let cell = |image: &Option<ImageU8>, caption: String| {
                image.clone().map(|image| ContactCell { image, caption })
            };
            let psnr = view.own_psnr_db.map_or_else(String::new, |db| format!("{db:.1} dB"));
            let first = [cell(&view.photo, String::new()), cell(&view.own, psnr)];
            let relit = view.relit.iter().map(|image| cell(image, String::new()));
            ContactRow {
                label: vec![view.name.clone()],
                cells: first.into_iter().chain(relit).collect(),
            }
        };
        ContactSheet {
            title: "The same scene in another light".into(),
            columns: columns.chain(self.lights.iter().cloned()).collect(),
            rows: self.views.iter().map(row).collect(),
            notes: vec![
                "dB: PSNR of the scene under the capture illumination against the photo.".into(),
            ],
        }
    }

    fn component_sheet(&self) -> ContactSheet {
        let names = self.views.iter().map(|v| &v.components).max_by_key(|c| c.len());
        let names = names.into_iter().flatten().map(|(name, _)| name.clone());
        let row = |view: &RelightView| {
            let cell = |image: &ImageU8| {
                Some(ContactCell { image: image.clone(), caption: String::new() })
            };
            let photo = view.photo.as_ref().and_then(cell);
            let parts = view.components.iter().map(|(_, image)| cell(image));
            ContactRow {
                label: vec![view.name.clone()],
                cells: std::iter::once(photo).chain(parts).collect(),
            }
        };
        ContactSheet {
            columns: std::iter::once("photo".to_owned()).chain(names).collect(),
            rows: self.views.iter().map(row).collect(),
            ..ContactSheet::default()
        }
    }

    fn lead(&self) -> String {
        let own = self.own_psnr_db().map_or_else(String::new, |db| {
            format!(
                " Under the capture illumination the scene reproduces held-out photos at {db:.1} dB."
            )
        });
        format!(
            "Photos were taken apart into a surface, its material and the light on it, and put together \
             again under {} other {}.{own}",
            self.lights.len(),
            if self.lights.len() == 1 { "light" } else { "lights" },
        )
    }

    fn comparison(&self, view: &RelightView) -> Comparison {
        let layer = |label: &str, image: &ImageU8| Layer {
            label: label.into(),
            description: format!("{label}: view {}", view.name),
            url: jpeg_url(image),
        };
        let mut layers: Vec<Layer> = view.photo.iter().map(|p| layer("Photo", p)).collect();
        layers.extend(view.own.iter().map(|p| layer("Own light", p)));
        let relit = self.lights.iter().zip(&view.relit);
        layers.extend(relit.filter_map(|(name, image)| Some(layer(name, image.as_ref()?))));
        let caption = view.own_psnr_db.map_or_else(String::new, |db| {
            format!("under the capture illumination {db:.2} dB against the photo")
        });
        let selected = layers.len().saturating_sub(1).min(2);
        Comparison { name: view.name.clone(), caption, layers, selected }
    }

    fn term_table(&self) -> Table {
        let row = |term: &RelightTerm| {
            let kept = if term.kept { "kept" } else { "left out" };
            vec![Cell::text(&*term.name), Cell::text(kept), Cell::text(&*term.evidence)]
        };
        Table {
            caption: "Terms of the image formation".into(),
            columns: ["term", "", "why"].map(Into::into).to_vec(),
            rows: self.terms.iter().map(row).collect(),
        }
    }

    fn step_table(&self) -> Table {
        let row = |step: &RelightStep| {
            let megabytes = step.peak_memory_bytes.map(|b| b as f64 / 1e6);
            vec![
                Cell::text(&*step.name),
                Cell::number(step.cpu_seconds, 1),
                Cell::number(step.seconds, 1),
                Cell::number(megabytes, 0),
            ]
        };
        Table {
            caption: "Every program that ran".into(),
            columns: ["program", "CPU s", "elapsed s", "peak MB"].map(Into::into).to_vec(),
            rows: self.steps.iter().map(row).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> RelightPage {
        let picture = |v: u8| Some(ImageU8::filled(24, 18, 3, v));
        let view = RelightView {
            name: "a<b>.png".into(),
            photo: picture(100),
            own: picture(110),
            own_psnr_db: Some(28.25),
            relit: vec![picture(40), None],
            components: vec![("base color".into(), ImageU8::filled(24, 18, 3, 90))],
        };
        let term = RelightTerm {
            name: "specular".into(),
            kept: false,
            evidence: "explains 0.1 % & costs".into(),
        };
        RelightPage {
            lights: vec!["sunrise".into(), "midday".into()],
            views: vec![view],
            terms: vec![term],
            steps: vec![RelightStep {
                name: "decompose".into(),
                cpu_seconds: Some(12.34),
                ..RelightStep::default()
            }],
            ..RelightPage::default()
        }
    }

    #[test]
    fn the_page_shows_each_light_and_says_what_was_left_out() {
        let html = page().to_html();
        for text in
            ["sunrise: view a&lt;b&gt;.png", "28.2 dB", "left out", "0.1 % &amp; costs", "12.3"]
        {
            assert!(html.contains(text), "{text}");
        }
        // A light without a picture has no button; nothing comes from outside.
        assert!(!html.contains("midday: view"));
        for outside in ["http://", "https://", "<link", "src=\"/"] {
            assert!(!html.contains(outside), "{outside}");
        }
    }

    #[test]
    fn an_empty_page_and_an_empty_sheet_are_still_documents() {
        assert!(RelightPage::default().to_html().contains("</html>"));
        assert!(RelightPage::default().to_contact_sheet().draw(100).width > 0);
        let sheet = page().to_contact_sheet();
        assert_eq!((sheet.columns.len(), sheet.rows[0].cells.len()), (4, 4));
    }
}
