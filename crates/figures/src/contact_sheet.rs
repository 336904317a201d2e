//! Contact sheets: a grid of pictures under column headings and beside row labels.

use motes_scene::ImageU8;

use crate::canvas::{Canvas, TextSize, ellipsize};

/// A grid of pictures. Rows may be shorter than the headings; missing cells stay empty.
#[derive(Clone, Debug, Default)]
pub struct ContactSheet {
    /// One line above everything.
    pub title: String,
    /// One heading per column.
    pub columns: Vec<String>,
    /// Rows from top to bottom.
    pub rows: Vec<ContactRow>,
    /// Lines under everything.
    pub notes: Vec<String>,
}

/// One row of a [`ContactSheet`].
#[derive(Clone, Debug, Default)]
pub struct ContactRow {
    /// Lines left of the row; the first one is drawn larger.
    pub label: Vec<String>,
    /// One picture per column, 1, 3 or 4 channels; `None` leaves the cell empty.
    pub cells: Vec<Option<ContactCell>>,
}

/// One picture of a [`ContactSheet`].
#[derive(Clone, Debug)]
pub struct ContactCell {
    /// The picture, scaled down to the cell width where it is wider.
    pub image: ImageU8,
    /// One line under the picture; may be empty.
    pub caption: String,
}

const GAP: usize = 12;
const PAPER: [u8; 3] = [250, 250, 248];
const INK: [u8; 3] = [28, 28, 30];
const FAINT: [u8; 3] = [110, 110, 112];

impl ContactSheet {
    /// Draws the sheet with cells of `cell_width` pixels. 3 channels.
    pub fn draw(&self, cell_width: usize) -> ImageU8 {
        let label_width = self.label_width();
        let columns = self.rows.iter().map(|row| row.cells.len()).chain([self.columns.len()]);
        let columns = columns.max().unwrap_or(0);
        let rows: Vec<Vec<Option<ImageU8>>> = self
            .rows
            .iter()
            .map(|row| {
                let fit = |cell: &Option<ContactCell>| {
                    cell.as_ref().map(|cell| shrink_to_width(&cell.image, cell_width))
                };
                row.cells.iter().map(fit).collect()
            })
            .collect();
        let picture_heights: Vec<usize> = rows
            .iter()
            .map(|row| row.iter().flatten().map(|image| image.height).max().unwrap_or(0))
            .collect();
        let caption_height = TextSize::Small.height() + 2;
        let row_height = |i: usize| {
            let captioned = self.rows[i].cells.iter().flatten().any(|c| !c.caption.is_empty());
            let label = self.label_height(i);
            (picture_heights[i] + if captioned { caption_height } else { 0 }).max(label) + GAP
        };

        let title_height = if self.title.is_empty() { 0 } else { TextSize::Title.height() + GAP };
        let heading_height = TextSize::Medium.height() + 4;
        let notes_height = self.notes.len() * (TextSize::Small.height() + 4);
        let grid_width = label_width + columns * (cell_width + GAP);
        let text_width = self
            .notes
            .iter()
            .map(|note| TextSize::Small.width_of(note))
            .chain([TextSize::Title.width_of(&self.title)])
            .max()
            .unwrap_or(0);
        let width = GAP + grid_width.max(text_width + GAP);
        let height = GAP
            + title_height
            + heading_height
            + (0..self.rows.len()).map(row_height).sum::<usize>()
            + notes_height
            + if notes_height > 0 { GAP } else { 0 };

        let mut canvas = Canvas::new(width, height, PAPER);
        canvas.text(GAP, GAP, TextSize::Title, INK, &self.title);
        let mut top = GAP + title_height;
        let left_of = |column: usize| GAP + label_width + column * (cell_width + GAP);
        for (column, heading) in self.columns.iter().enumerate() {
            let fits = cell_width / TextSize::Medium.width_of("x");
            let heading = ellipsize(heading, fits);
            canvas.text(left_of(column), top, TextSize::Medium, INK, &heading);
        }
        top += heading_height;
        for (i, row) in self.rows.iter().enumerate() {
            let mut line_top = top;
            for (k, line) in row.label.iter().enumerate() {
                let (size, color) =
                    if k == 0 { (TextSize::Medium, INK) } else { (TextSize::Small, FAINT) };
                canvas.text(GAP, line_top, size, color, line);
                line_top += size.height() + 4;
            }
            for (column, (cell, image)) in row.cells.iter().zip(&rows[i]).enumerate() {
                let (Some(cell), Some(image)) = (cell, image) else { continue };
                canvas.blit(image, left_of(column), top);
                let fits = cell_width / TextSize::Small.width_of("x");
                let caption = ellipsize(&cell.caption, fits);
                let caption_top = top + image.height + 2;
                canvas.text(left_of(column), caption_top, TextSize::Small, FAINT, &caption);
            }
            top += row_height(i);
        }
        for note in &self.notes {
            canvas.text(GAP, top, TextSize::Small, FAINT, note);
            top += TextSize::Small.height() + 4;
        }
        canvas.into_image()
    }

    fn label_width(&self) -> usize {
        let lines = self.rows.iter().flat_map(|row| {
            row.label.iter().enumerate().map(|(k, line)| {
                if k == 0 { TextSize::Medium } else { TextSize::Small }.width_of(line)
            })
        });
        lines.max().map_or(0, |width| width + GAP)
    }

    fn label_height(&self, row: usize) -> usize {
        let lines = self.rows[row].label.len();
        TextSize::Medium.height() + lines.saturating_sub(1) * (TextSize::Small.height() + 4)
    }
}

/// The picture at `width` pixels by averaging the area that falls under each new pixel; unchanged
/// when it is not wider.
pub fn shrink_to_width(image: &ImageU8, width: usize) -> ImageU8 {
    if image.width <= width || width == 0 {
        return image.clone();
    }
    let height = ((image.height * width) as f64 / image.width as f64).round().max(1.0) as usize;
    let horizontal = area_weights(image.width, width);
    let vertical = area_weights(image.height, height);
    let mut out = ImageU8::filled(width, height, image.channels, 0);
    for (y, (y0, wy)) in vertical.iter().enumerate() {
        for (x, (x0, wx)) in horizontal.iter().enumerate() {
            for c in 0..image.channels {
                let mut sum = 0.0;
                for (dy, weight_y) in wy.iter().enumerate() {
                    for (dx, weight_x) in wx.iter().enumerate() {
                        let value = image.pixel(x0 + dx, y0 + dy)[c];
                        sum += weight_y * weight_x * f32::from(value);
                    }
                }
                out.pixel_mut(x, y)[c] = sum.round().clamp(0.0, 255.0) as u8;
            }
        }
    }
    out
}

/// Per output pixel: the first input pixel it covers and the share of each covered one.
fn area_weights(input: usize, output: usize) -> Vec<(usize, Vec<f32>)> {
    let scale = input as f64 / output as f64;
    (0..output)
        .map(|i| {
            let (from, to) = (i as f64 * scale, (i + 1) as f64 * scale);
            let first = from.floor() as usize;
            let last = (to.ceil() as usize).min(input);
            let share = |k: usize| (to.min(k as f64 + 1.0) - from.max(k as f64)) / scale;
            (first, (first..last).map(|k| share(k) as f32).collect())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_land_where_their_column_is() {
        let cell = |value| {
            let image = ImageU8::filled(40, 30, 1, value);
            Some(ContactCell { image, caption: "24.1 dB".into() })
        };
        let sheet = ContactSheet {
            title: "Title".into(),
            columns: vec!["first".into(), "second".into()],
            rows: vec![
                ContactRow { label: vec!["A".into(), "more".into()], cells: vec![cell(10), None] },
                ContactRow { label: vec!["B".into()], cells: vec![cell(20), cell(30)] },
            ],
            notes: vec!["a note".into()],
        };
        let image = sheet.draw(40);
        let count = |value: u8| image.data.chunks(3).filter(|p| **p == [value; 3]).count();
        for value in [10, 20, 30] {
            assert!(count(value) >= 40 * 30, "{value} is drawn whole");
        }
        let column_of =
            |value: u8| image.data.chunks(3).position(|p| *p == [value; 3]).unwrap() % image.width;
        assert_eq!(column_of(10), column_of(20));
        assert_eq!(column_of(30), column_of(20) + 40 + GAP);
    }

    #[test]
    fn shrinking_keeps_the_mean_and_the_aspect() {
        let data: Vec<u8> = (0..90 * 50 * 3).map(|i| ((i * 31) % 251) as u8).collect();
        let image = ImageU8::from_data(90, 50, 3, data);
        let small = shrink_to_width(&image, 36);
        assert_eq!((small.width, small.height), (36, 20));
        let mean =
            |i: &ImageU8| i.data.iter().map(|&v| f64::from(v)).sum::<f64>() / i.data.len() as f64;
        assert!((mean(&image) - mean(&small)).abs() < 0.5);
        assert_eq!(shrink_to_width(&image, 90), image);
    }

    #[test]
    fn an_empty_sheet_is_still_a_picture() {
        let image = ContactSheet::default().draw(100);
        assert!(image.width > 0 && image.height > 0);
    }
}
