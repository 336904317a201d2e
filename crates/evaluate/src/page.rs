//! The report of an evaluation.

use motes_formats::metrics::Scores;
use motes_scene::{ImageU8, Split, SplitChoice};

use crate::score::{Photo, ViewRow, mean_scores, spread};
use crate::training_curves::Training;
use motes_figures::error_map::{ERROR_FULL_SCALE, error_map, scale_bar};
use motes_figures::html::{Cell, Comparison, Layer, Page, Table, jpeg_url, png_url};
use motes_figures::svg_plot::{LinePlot, Series};

/// Scores of one set of renders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelScores {
    /// File or folder that was scored.
    pub name: String,
    /// Number of Gaussians, when it was a model.
    pub gaussians: Option<usize>,
    /// One row per view, in the order of the capture.
    pub rows: Vec<ViewRow>,
}

impl ModelScores {
    /// The rows of a split.
    pub fn rows_of(&self, split: SplitChoice) -> impl Iterator<Item = &ViewRow> {
        self.rows.iter().filter(move |row| split.includes(row.split))
    }

    /// Means over the views of a split; `None` where no view of it was scored.
    pub fn mean_of(&self, split: SplitChoice) -> Option<Scores> {
        self.rows_of(split).next().map(|_| mean_scores(self.rows_of(split)))
    }

    /// Train PSNR minus test PSNR, dB.
    pub fn gap(&self) -> Option<f64> {
        Some(self.mean_of(SplitChoice::Train)?.psnr? - self.mean_of(SplitChoice::Test)?.psnr?)
    }
}

/// Pictures of one view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewPictures {
    name: String,
    layers: Vec<Layer>,
}

impl ViewPictures {
    /// Encodes photo, render (3 channels, same size) and their error map.
    pub fn new(name: &str, photo: &Photo, render: &ImageU8) -> Self {
        let layer =
            |label: &str, description: String, url| Layer { label: label.into(), description, url };
        let error = error_map(&photo.rgb, render, photo.counted.as_deref());
        let layers = vec![
            layer("Photo", format!("Photo {name}"), jpeg_url(&photo.rgb)),
            layer("Render", format!("Render of view {name}"), jpeg_url(render)),
            layer(
                "Error",
                format!("Error map of view {name}: brighter is worse"),
                jpeg_url(&error),
            ),
        ];
        Self { name: name.to_owned(), layers }
    }
}

/// Pictures of at most a given number of views, evenly spread over those that are offered.
#[derive(Clone, Debug, Default)]
pub struct PictureChoice {
    total: usize,
    most: usize,
    offered: usize,
    chosen: Vec<ViewPictures>,
}

impl PictureChoice {
    /// For `total` views to come, of which at most `most` are kept.
    pub fn new(total: usize, most: usize) -> Self {
        Self { total, most, ..Self::default() }
    }

    /// Encodes the pictures of the next view when it is one of the chosen.
    pub fn offer(&mut self, name: &str, photo: &Photo, render: &ImageU8) {
        // Of every run of total / most views, the last one.
        let share = |views: usize| views * self.most.min(self.total) / self.total.max(1);
        if share(self.offered + 1) > share(self.offered) {
            self.chosen.push(ViewPictures::new(name, photo, render));
        }
        self.offered += 1;
    }
}

/// Everything on the page.
#[derive(Clone, Debug, Default)]
pub struct EvaluationPage {
    /// What was scored, for example two seeds of one scene.
    pub models: Vec<ModelScores>,
    /// The split asked for, then others that were scored.
    pub splits: Vec<SplitChoice>,
    /// Pictures of the first model.
    pub pictures: PictureChoice,
    /// Curves and decisions of the training, when given.
    pub training: Training,
    /// Names and values of the protocol.
    pub protocol: Vec<(String, String)>,
}

impl EvaluationPage {
    /// The document.
    pub fn to_html(&self) -> String {
        let mut page = Page::new("Evaluation", &self.lead());
        page.table(&self.summary());
        if !self.pictures.chosen.is_empty() {
            page.heading("Photo, render, error");
            self.write_pictures(&mut page);
        }
        let first = self.models.first();
        if let Some(model) = first {
            page.heading("Every view");
            page.table(&view_table(model));
            page.plot(&self.view_plot(model));
        }
        if !(self.training.plots.is_empty() && self.training.tables.is_empty()) {
            page.heading("Training");
        }
        for plot in &self.training.plots {
            page.plot(plot);
        }
        for table in &self.training.tables {
            page.table(table);
        }
        page.heading("Protocol");
        page.definitions(&self.protocol);
        page.finish()
    }

    fn lead(&self) -> String {
        let (Some(model), Some(&split)) = (self.models.first(), self.splits.first()) else {
            return "Nothing was scored.".into();
        };
        let what = match split {
            SplitChoice::Test => "views that were held out of the training",
            SplitChoice::Train => "views that the model was fitted to",
            SplitChoice::All => "views of both splits",
        };
        let n = model.rows_of(split).count();
        format!("How close renders are to {n} photos: {what}.")
    }

    fn summary(&self) -> Table {
        let mut rows = Vec::new();
        for &split in &self.splits {
            let mut all = Vec::new();
            for model in &self.models {
                let Some(scores) = model.mean_of(split) else { continue };
                all.push(scores);
                let mut row = vec![Cell::text(short_path(&model.name)), Cell::text(split.name())];
                row.push(Cell::count(model.rows_of(split).count()));
                row.extend(score_cells(&scores));
                row.push(Cell::number(model.gap(), 2));
                row.push(model.gaussians.map_or_else(|| Cell::number(None, 0), Cell::count));
                rows.push(row);
            }
            if all.len() > 1 {
                let (mean, deviation) = spread(&all);
                for (name, scores) in [("mean", mean), ("standard deviation", deviation)] {
                    let mut row = vec![Cell::text(name), Cell::text(split.name())];
                    row.push(Cell::number(None, 0));
                    row.extend(score_cells(&scores));
                    row.extend([Cell::number(None, 0), Cell::number(None, 0)]);
                    rows.push(row);
                }
            }
        }
        let columns = [
            "model",
            "split",
            "views",
            "PSNR dB",
            "float",
            "color-corrected",
            "SSIM",
            "LPIPS",
            "gap dB",
            "Gaussians",
        ];
        let caption = "Means over views; gap = train PSNR minus test PSNR";
        Table { caption: caption.into(), columns: columns.map(Into::into).to_vec(), rows }
    }

    fn view_plot(&self, model: &ModelScores) -> LinePlot {
        let series = |&split: &SplitChoice| {
            let numbered = (1u32..).zip(&model.rows);
            let of_split = numbered.filter(|(_, row)| split.includes(row.split));
            let points = of_split.map(|(i, row)| (f64::from(i), row.score.psnr)).collect();
            Series { name: split.name().into(), points }
        };
        LinePlot {
            title: "PSNR of every view".into(),
            x_label: "row of the table".into(),
            y_label: "PSNR, dB".into(),
            series: self.splits.iter().map(series).filter(|s| s.points.len() > 1).collect(),
        }
    }

    fn write_pictures(&self, page: &mut Page) {
        page.paragraph(
            "Choose a picture below each view; the slider, or dragging on the picture, uncovers \
             the photo from the left.",
        );
        let rows = self.models.first().map_or(&[][..], |model| &model.rows);
        let comparisons: Vec<Comparison> = self
            .pictures
            .chosen
            .iter()
            .map(|pictures| {
                let row = rows.iter().find(|row| row.name == pictures.name);
                let caption = row.map_or_else(String::new, |row| {
                    format!("PSNR {:.2} dB, SSIM {:.3}", row.score.psnr, row.score.ssim)
                });
                let layers = pictures.layers.clone();
                Comparison { name: pictures.name.clone(), caption, layers, selected: 1 }
            })
            .collect();
        page.comparisons(&comparisons);
        let n = self.pictures.offered - self.pictures.chosen.len();
        if n > 0 {
            page.paragraph(&format!(
                "Pictures of {n} more views were left out; their scores are below."
            ));
        }
        let caption = format!(
            "Error: mean absolute difference over R, G, B from 0 (left) to {ERROR_FULL_SCALE} of \
             255 or more (right); gray is masked out."
        );
        page.picture(&png_url(&scale_bar(256, 12)), "Color scale of the error maps", &caption);
    }
}

/// The last two parts of a path: enough to tell runs apart.
fn short_path(path: &str) -> &str {
    let mut slashes = path.rmatch_indices(['/', '\\']).map(|(at, _)| at + 1);
    slashes.nth(1).map_or(path, |start| &path[start..])
}

fn score_cells(score: &Scores) -> [Cell; 5] {
    [
        Cell::number(score.psnr, 2),
        Cell::number(score.psnr_float, 2),
        Cell::number(score.psnr_color_corrected, 2),
        Cell::number(score.ssim, 4),
        Cell::number(score.lpips, 4),
    ]
}

fn view_table(model: &ModelScores) -> Table {
    let row = |row: &ViewRow| {
        let split = if row.split == Split::Test { "test" } else { "train" };
        let mut cells = vec![Cell::text(&row.name), Cell::text(split)];
        cells.extend(score_cells(&row.scores()));
        cells.push(Cell::number(100.0 * row.score.counted_share, 1));
        cells
    };
    let columns =
        ["view", "split", "PSNR dB", "float", "color-corrected", "SSIM", "LPIPS", "counted %"];
    Table {
        caption: format!(
            "{} views; counted: share of pixels that no mask takes out",
            model.rows.len()
        ),
        columns: columns.map(Into::into).to_vec(),
        rows: model.rows.iter().map(row).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::ViewScore;

    fn row(name: &str, split: Split, psnr: f64) -> ViewRow {
        let score = ViewScore {
            psnr,
            psnr_float: psnr,
            psnr_color_corrected: psnr,
            ssim: 0.8,
            lpips: None,
            counted_share: 1.0,
        };
        ViewRow { name: name.into(), split, score }
    }

    #[test]
    fn chosen_pictures_are_evenly_spread() {
        let photo = Photo { rgb: ImageU8::filled(8, 6, 3, 90), counted: None };
        let names = |total: usize, most: usize| -> Vec<String> {
            let mut choice = PictureChoice::new(total, most);
            for i in 0..total {
                choice.offer(&i.to_string(), &photo, &photo.rgb);
            }
            choice.chosen.into_iter().map(|pictures| pictures.name).collect()
        };
        assert_eq!(names(3, 24), ["0", "1", "2"]);
        assert_eq!(names(8, 4), ["1", "3", "5", "7"]);
        assert!(names(5, 0).is_empty());
    }

    #[test]
    fn the_page_has_table_pictures_curve_and_protocol() {
        let photo = Photo { rgb: ImageU8::filled(8, 6, 3, 90), counted: None };
        let mut pictures = PictureChoice::new(2, 1);
        pictures.offer("a.jpg", &photo, &photo.rgb);
        pictures.offer("b.jpg", &photo, &photo.rgb);
        let rows = vec![
            row("a.jpg", Split::Test, 21.0),
            row("b.jpg", Split::Test, 23.0),
            row("c.jpg", Split::Train, 30.0),
        ];
        let model = |name: &str| ModelScores {
            name: name.into(),
            gaussians: Some(1000),
            rows: rows.clone(),
        };
        let page = EvaluationPage {
            models: vec![model("seed<0>.ply"), model("seed1.ply")],
            splits: vec![SplitChoice::Test, SplitChoice::Train],
            pictures,
            training: Training::default(),
            protocol: vec![("masks".into(), "excluded".into())],
        };
        assert_eq!(short_path("/a/b/c/d.ply"), "c/d.ply");
        assert_eq!(short_path("c/d.ply"), "c/d.ply");
        let html = page.to_html();
        assert!(html.contains("renders are to 2 photos: views that were held out"));
        assert!(html.contains("seed&lt;0&gt;.ply") && html.contains("standard deviation"));
        assert!(html.contains(">22.00<") && html.contains(">8.00<"), "mean and gap");
        assert_eq!(html.matches("<figure class=\"compare\">").count(), 1);
        assert!(html.contains("Pictures of 1 more views were left out"));
        assert!(html.contains("PSNR of every view") && html.contains("<dt>masks</dt>"));
    }
}
