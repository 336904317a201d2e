//! The lab's report: the same held-out views from models of fewer and fewer photos.

use motes_formats::metrics::Scores;
use motes_scene::ImageU8;

use motes_figures::contact_sheet::{ContactCell, ContactRow, ContactSheet};
use motes_figures::html::{Cell, Comparison, Layer, Link, Page, Table, jpeg_url};
use motes_figures::svg_plot::{LinePlot, Series};

/// One training run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabRun {
    /// Number of training photos.
    pub photos: usize,
    /// Scores on the photos it was fitted to.
    pub train: Scores,
    /// Scores on the held-out photos.
    pub test: Scores,
    /// Number of Gaussians.
    pub gaussians: Option<usize>,
    /// Wall-clock seconds of the training.
    pub seconds: Option<f64>,
}

impl LabRun {
    /// Train PSNR minus test PSNR, dB.
    pub fn gap(&self) -> Option<f64> {
        Some(self.train.psnr? - self.test.psnr?)
    }
}

/// One viewpoint and what every run renders there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabView {
    /// Name of the photo, or what the viewpoint is.
    pub name: String,
    /// The photo; there is none at a made-up viewpoint.
    pub photo: Option<ImageU8>,
    /// Per run, the render.
    pub renders: Vec<Option<ImageU8>>,
    /// Per run, PSNR in dB.
    pub psnr: Vec<Option<f64>>,
}

/// Everything on the page and the sheet.
#[derive(Clone, Debug, Default)]
pub struct LabPage {
    /// Runs, most photos first.
    pub runs: Vec<LabRun>,
    /// Held-out views, then made-up viewpoints.
    pub views: Vec<LabView>,
    /// How good the poses are, in sentences.
    pub poses: Vec<String>,
    /// Interactive pages of the models.
    pub links: Vec<Link>,
    /// How it was made: preset, seed, machine time.
    pub protocol: Vec<(String, String)>,
}

/// Below this a model is far from its own photos, dB.
const LOW_PSNR: f64 = 25.0;

/// What low scores mean, where even the photos that the model of the most photos was fitted to have them.
fn low_scores(most: &LabRun) -> Option<String> {
    let train = most.train.psnr.filter(|psnr| *psnr < LOW_PSNR)?;
    let error = 100.0 * 10f64.powf(-train / 20.0);
    Some(format!(
        "Even the photos that the model of {} photos was fitted to come out at only {train:.1} dB, an \
         error of {error:.0} % of white on average. Such a score is common for few steps (--preset draft), for photos whose \
         exposure, focus or subject changed between them, and for poses that are a little off; fine texture costs decibels \
         that nobody sees. Compare scores of one set of photos with each other, not with those of another.",
        most.photos
    ))
}

impl LabPage {
    /// Test PSNR that the last run lost against the first, dB.
    fn loss(&self) -> Option<f64> {
        Some(self.runs.first()?.test.psnr? - self.runs.last()?.test.psnr?)
    }

    /// The document.
    pub fn to_html(&self) -> String {
        let mut page = Page::new("How many photos does a splat need?", &self.lead());
        page.table(&self.table());
        page.plot(&self.plot());
        page.heading("What the numbers say");
        for sentence in self.findings() {
            page.paragraph(&sentence);
        }
        page.heading("The same unseen views from each model");
        page.paragraph(
            "Choose a model below each view; the slider, or dragging on the picture, uncovers the \
             photo from the left. Look for floaters (haze or blobs that hang in front of the \
             scene), for surfaces drawn as needles, and for holes.",
        );
        let comparisons: Vec<Comparison> =
            self.views.iter().map(|view| self.comparison(view)).collect();
        page.comparisons(&comparisons);
        if !self.links.is_empty() {
            page.heading("Fly through the models");
            page.links(&self.links);
        }
        page.heading("Why few photos fail");
        page.list(&WHY.map(str::to_owned));
        page.heading("What to try next");
        page.list(&NEXT.map(str::to_owned));
        if !self.poses.is_empty() {
            page.heading("Were the camera poses right?");
            for sentence in &self.poses {
                page.paragraph(sentence);
            }
        }
        page.heading("How this was made");
        page.definitions(&self.protocol);
        page.finish()
    }

    /// The contact sheet: a row per run under a row of photos, a column per view.
    pub fn to_contact_sheet(&self) -> ContactSheet {
        let photos = ContactRow {
            label: vec!["photo".into(), "ground truth,".into(), "held out".into()],
            cells: self
                .views
                .iter()
                .map(|view| {
                    let image = view.photo.clone()?;
                    Some(ContactCell { image, caption: String::new() })
                })
                .collect(),
        };
        let run_row = |(i, run): (usize, &LabRun)| ContactRow {
            label: vec![
                format!("{} photos", run.photos),
                format!("train {} dB", decimals(run.train.psnr)),
                format!("test  {} dB", decimals(run.test.psnr)),
                format!("gap   {} dB", decimals(run.gap())),
            ],
            cells: self
                .views
                .iter()
                .map(|view| {
                    let image = view.renders.get(i)?.clone()?;
                    let psnr = view.psnr.get(i).copied().flatten();
                    let caption = psnr.map_or_else(String::new, |psnr| format!("{psnr:.1} dB"));
                    Some(ContactCell { image, caption })
                })
                .collect(),
        };
        ContactSheet {
            title: "The same unseen views from models of fewer and fewer photos".into(),
            columns: self.views.iter().map(|view| view.name.clone()).collect(),
            rows: std::iter::once(photos)
                .chain(self.runs.iter().enumerate().map(run_row))
                .collect(),
            notes: vec![
                "dB: PSNR against the photo, higher is better. Where there is no photo, none was taken."
                    .into(),
            ],
        }
    }

    fn lead(&self) -> String {
        let (Some(first), Some(last)) = (self.runs.first(), self.runs.last()) else {
            return "No runs.".into();
        };
        format!(
            "The same scene was fitted to {} and then to {} photos, with the same camera poses. \
             Photos that no run saw were predicted at {} dB with {} photos and {} dB with {}.",
            first.photos,
            list(self.runs.iter().skip(1).map(|run| run.photos.to_string())),
            decimals(first.test.psnr),
            first.photos,
            decimals(last.test.psnr),
            last.photos,
        )
    }

    fn table(&self) -> Table {
        let row = |run: &LabRun| {
            vec![
                Cell::text(run.photos.to_string()),
                Cell::number(run.train.psnr, 2),
                Cell::number(run.test.psnr, 2),
                Cell::number(run.gap(), 2),
                Cell::number(run.test.ssim, 3),
                run.gaussians.map_or_else(|| Cell::number(None, 0), Cell::count),
                Cell::number(run.seconds, 0),
            ]
        };
        let columns = [
            "photos",
            "train PSNR dB",
            "test PSNR dB",
            "gap dB",
            "test SSIM",
            "Gaussians",
            "seconds",
        ];
        Table {
            caption: "train: photos the model was fitted to; test: photos no run saw; gap: train \
                      minus test; seconds of training"
                .into(),
            columns: columns.map(Into::into).to_vec(),
            rows: self.runs.iter().map(row).collect(),
        }
    }

    fn plot(&self) -> LinePlot {
        let series = |name: &str, value: fn(&LabRun) -> Option<f64>| Series {
            name: name.into(),
            points: self
                .runs
                .iter()
                .filter_map(|run| Some((run.photos as f64, value(run)?)))
                .collect(),
        };
        LinePlot {
            title: "The gap opens as photos go".into(),
            x_label: "training photos".into(),
            y_label: "PSNR, dB".into(),
            series: vec![
                series("photos it was fitted to", |run| run.train.psnr),
                series("photos it never saw", |run| run.test.psnr),
            ],
        }
    }

    fn findings(&self) -> Vec<String> {
        let (Some(first), Some(last), Some(loss)) =
            (self.runs.first(), self.runs.last(), self.loss())
        else {
            return vec!["The runs have no held-out scores to compare.".into()];
        };
        let (Some(first_gap), Some(last_gap)) = (first.gap(), last.gap()) else {
            return vec!["The runs have no training scores to compare.".into()];
        };
        let mut findings = vec![format!(
            "From {} photos to {}, the error on unseen photos grew by {loss:.1} dB: the mean \
             squared error is {:.1} times as large.",
            first.photos,
            last.photos,
            10f64.powf(loss / 10.0)
        )];
        if last_gap - first_gap >= 2.0 {
            findings.push(format!(
                "The training photos do not show it: the gap between train and test went from \
                 {first_gap:.1} to {last_gap:.1} dB. A model can fit the photos it was given and be \
                 wrong everywhere else. That is why a score on training photos proves nothing, and \
                 why some photos must be held out."
            ));
        } else {
            findings.push(format!(
                "The gap between train and test went from {first_gap:.1} to {last_gap:.1} dB, which \
                 is little: here the model does not memorize its photos more as they get fewer. \
                 Photos from farther apart, or fewer of them, show the effect more."
            ));
        }
        findings.extend(low_scores(first));
        findings
    }

    fn comparison(&self, view: &LabView) -> Comparison {
        let mut layers = Vec::new();
        if let Some(photo) = &view.photo {
            layers.push(Layer {
                label: "Photo".into(),
                description: format!("Photo {}", view.name),
                url: jpeg_url(photo),
            });
        }
        let mut scores = Vec::new();
        for (i, run) in self.runs.iter().enumerate() {
            let Some(Some(render)) = view.renders.get(i) else { continue };
            layers.push(Layer {
                label: format!("{} photos", run.photos),
                description: format!(
                    "{} rendered by the model of {} photos",
                    view.name, run.photos
                ),
                url: jpeg_url(render),
            });
            if let Some(psnr) = view.psnr.get(i).copied().flatten() {
                scores.push(format!("{} photos {psnr:.1} dB", run.photos));
            }
        }
        // Start on the run where the failure shows most.
        let selected = layers.len().saturating_sub(1);
        Comparison { name: view.name.clone(), caption: scores.join(", "), layers, selected }
    }
}

const WHY: [&str; 4] = [
    "A pixel of one photo fixes a color along a ray, not where on the ray the surface is. Depth \
     comes from seeing the same point from several sides.",
    "Seen by one or two photos only, the cheapest way to lower the training error is a Gaussian \
     right in front of a camera: it paints that photo and is wrong for every other viewpoint. These \
     are the floaters.",
    "View-dependent color (spherical harmonics) can do the same: with few photos, each direction \
     gets a color of its own that no other photo contradicts.",
    "Long thin Gaussians that point at a camera cost nothing in its photo and show as needles from \
     the side.",
];

const NEXT: [&str; 5] = [
    "More photos, or the same number better placed: move sideways by about 10 to 15 degrees between \
     photos instead of turning on the spot.",
    "Fewer degrees of freedom: `train-splat --sh-degree 0` takes view-dependent color away.",
    "Shorter training: `train-splat --iterations N` with a smaller N; the test PSNR of few photos \
     peaks early.",
    "A fixed budget: `train-splat --max-gaussians N`.",
    "Other seeds: `train-splat --seed 1` and `--seed 2`, then `evaluate` with all three files \
     reports mean and spread. A difference below the spread is noise.",
];

fn decimals(value: Option<f64>) -> String {
    value.map_or_else(|| "?".into(), |v| format!("{v:.1}"))
}

fn list(items: impl Iterator<Item = String>) -> String {
    let items: Vec<String> = items.collect();
    match items.split_last() {
        None => String::new(),
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(test: [f64; 2]) -> LabPage {
        let run = |photos, test| LabRun {
            photos,
            train: Scores { psnr: Some(33.0), ..Scores::default() },
            test: Scores { psnr: Some(test), ..Scores::default() },
            gaussians: Some(12_345),
            seconds: Some(61.0),
        };
        let image = |value| Some(ImageU8::filled(30, 20, 3, value));
        let view = |name: &str, photo| LabView {
            name: name.into(),
            photo,
            renders: vec![image(50), image(60)],
            psnr: vec![Some(30.0), None],
        };
        LabPage {
            runs: vec![run(20, test[0]), run(5, test[1])],
            views: vec![view("a.jpg", image(40)), view("halfway", None)],
            ..LabPage::default()
        }
    }

    #[test]
    fn the_text_follows_the_numbers() {
        let html = page([31.0, 22.0]).to_html();
        assert!(html.contains("grew by 9.0 dB") && html.contains("7.9 times"));
        assert!(html.contains("from 2.0 to 11.0 dB"));
        let html = page([31.0, 30.5]).to_html();
        assert!(html.contains("which is little") && !html.contains("Even the photos"));
        // A score on its own photos that is low is not passed off as a fit.
        let mut low = page([20.0, 12.0]);
        low.runs[0].train.psnr = Some(22.0);
        let html = low.to_html();
        assert!(html.contains("come out at only 22.0 dB") && !html.contains("every photo it was"));
    }

    #[test]
    fn a_view_without_a_photo_still_compares_the_runs() {
        let html = page([31.0, 22.0]).to_html();
        assert_eq!(html.matches("<figure class=\"compare\">").count(), 2);
        assert_eq!(html.matches("alt=\"Photo").count(), 1);
        assert_eq!(html.matches("rendered by the model of 5 photos").count(), 2);
    }

    #[test]
    fn the_sheet_has_a_row_per_run_and_one_of_photos() {
        let sheet = page([31.0, 22.0]).to_contact_sheet();
        assert_eq!((sheet.rows.len(), sheet.columns.len()), (3, 2));
        assert!(sheet.rows[0].cells[1].is_none() && sheet.rows[2].cells[1].is_some());
        assert_eq!(sheet.rows[1].label[3], "gap   2.0 dB");
    }

    #[test]
    fn links_lead_to_the_models_and_are_escaped() {
        let link = Link { label: "<20> photos".into(), url: "20/model.html".into() };
        let page = LabPage { links: vec![link], ..page([24.0, 20.0]) };
        let html = page.to_html();
        assert!(html.contains("<a href=\"20/model.html\">&lt;20&gt; photos</a>"), "{html}");
    }

    #[test]
    fn missing_runs_do_not_break_the_page() {
        let html = LabPage::default().to_html();
        assert!(html.contains("No runs.") && !html.contains("NaN"));
    }
}
