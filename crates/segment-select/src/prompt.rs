//! From pixels of views to superpixels: clicks, strokes, rectangles.

use motes_formats::selectors::ObjectPrompt;

use crate::error::SelectError;
use crate::index::SceneIndex;
use crate::seeds::Seeds;
use crate::source::SelectSource;
use crate::view_data::ViewData;

/// Distance between the samples of a stroke, pixels of the working size: half a superpixel.
const STROKE_STEP: f64 = 4.0;

/// What a prompt says about the superpixels of `index`.
pub(crate) fn seeds(
    source: &SelectSource<'_>,
    index: &SceneIndex,
    prompt: &ObjectPrompt,
) -> Result<Seeds, SelectError> {
    let positive = prompt.clicks.iter().any(|c| c.positive)
        || prompt.scribbles.iter().any(|s| s.positive)
        || !prompt.boxes.is_empty();
    if !positive {
        return Err(SelectError::NothingPositive);
    }
    let mut seeds = Seeds::default();
    for click in &prompt.clicks {
        let place = Place::of(source, index, &click.view)?;
        let nodes = place.nodes_at(click.pixel)?;
        if nodes.is_empty() {
            let ([x, y], view) = (click.pixel, click.view.clone());
            return Err(SelectError::NothingThere { view, x, y });
        }
        seeds.order.push(click.positive);
        let list = if click.positive { &mut seeds.positive } else { &mut seeds.negative };
        list.push(nodes);
    }
    for scribble in &prompt.scribbles {
        let place = Place::of(source, index, &scribble.view)?;
        let mut nodes = Vec::new();
        for pixel in along(&scribble.points, STROKE_STEP / place.scale) {
            nodes.extend(place.nodes_at(pixel)?);
        }
        let mut seen = std::collections::BTreeSet::new();
        nodes.retain(|n| seen.insert(*n));
        seeds.order.push(scribble.positive);
        let list = if scribble.positive { &mut seeds.positive } else { &mut seeds.negative };
        list.push(nodes);
    }
    for rectangle in &prompt.boxes {
        let place = Place::of(source, index, &rectangle.view)?;
        let [x0, y0, x1, y1] = rectangle.pixels;
        let (left, right) = (x0.min(x1) * place.scale, x0.max(x1) * place.scale);
        let (top, bottom) = (y0.min(y1) * place.scale, y0.max(y1) * place.scale);
        if !(right > left && bottom > top) {
            let text = format!("the box of view \"{}\" is empty", rectangle.view);
            return Err(SelectError::BadValue(text));
        }
        let data = place.data();
        let mut inside = Vec::new();
        for (s, segment) in data.segments.iter().enumerate() {
            let [x, y] = segment.center_px.map(f64::from);
            let (dx, dy) = ((x - left).min(right - x), (y - top).min(bottom - y));
            let nodes = || place.nodes_of(s as u32);
            if dx < 0.0 || dy < 0.0 {
                seeds.outside.extend(nodes());
            } else {
                inside.push(((x - (left + right) / 2.0).hypot(y - (top + bottom) / 2.0), s as u32));
            }
        }
        inside.sort_by(|a, b| a.0.total_cmp(&b.0));
        let middle = inside.iter().flat_map(|&(_, s)| place.nodes_of(s)).collect();
        seeds.boxes.push(middle);
    }
    if seeds.positive.is_empty() && seeds.boxes.iter().all(Vec::is_empty) {
        return Err(SelectError::NothingPositive);
    }
    Ok(seeds)
}

/// Points along a stroke, `step` apart.
fn along(points: &[[f64; 2]], step: f64) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = points.iter().copied().take(1).collect();
    for pair in points.windows(2) {
        let [dx, dy] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let count = (dx.hypot(dy) / step).ceil().clamp(1.0, 10_000.0);
        for k in 1..=count as usize {
            let t = k as f64 / count;
            out.push([pair[0][0] + t * dx, pair[0][1] + t * dy]);
        }
    }
    out
}

/// A view that a prompt names: one of the prepared ones, or another that is prepared for the prompt.
pub(crate) struct Place<'a> {
    index: &'a SceneIndex,
    name: String,
    /// As it was taken.
    size: [usize; 2],
    /// Working pixels per pixel.
    pub(crate) scale: f64,
    prepared: Option<usize>,
    own: Option<ViewData>,
}

impl<'a> Place<'a> {
    pub(crate) fn of(
        source: &SelectSource<'_>,
        index: &'a SceneIndex,
        name: &str,
    ) -> Result<Self, SelectError> {
        let view = source.view_named(name)?;
        let camera = source.camera(view)?;
        let prepared = index.capture_views.iter().position(|&v| v == view);
        let own = match prepared {
            Some(_) => None,
            None => Some(source.prepare(view)?),
        };
        let data = own.as_ref().or(prepared.map(|p| &index.views[p]));
        let scale = data.map_or(1.0, |d| d.camera.width as f64 / camera.width as f64);
        let size = [camera.width, camera.height];
        Ok(Self { index, name: name.into(), size, scale, prepared, own })
    }

    pub(crate) fn data(&self) -> &ViewData {
        match (&self.own, self.prepared) {
            (Some(own), _) => own,
            (None, prepared) => &self.index.views[prepared.unwrap_or(0)],
        }
    }

    /// Superpixels at a pixel of the photo, the clicked one first where its view is prepared, then
    /// those of other views that show the same place.
    pub(crate) fn nodes_at(&self, [x, y]: [f64; 2]) -> Result<Vec<u32>, SelectError> {
        let [width, height] = self.size;
        if !(x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64) {
            return Err(SelectError::PixelOutside { view: self.name.clone(), x, y, width, height });
        }
        let data = self.data();
        let (x, y) = (x * self.scale, y * self.scale);
        let (x, y) =
            (x.min(data.camera.width as f64 - 0.5), y.min(data.camera.height as f64 - 0.5));
        let mut nodes = Vec::new();
        if let (Some(view), Some(segment)) = (self.prepared, data.segment_at(x, y))
            && data.segments[segment as usize].width > 0.0
        {
            nodes.push(segment + self.index.offsets[view]);
        }
        if let Some(point) = data.point_at(x, y) {
            nodes.extend(self.index.nodes_at(point.as_vec3()));
        }
        let first = nodes.first().copied();
        nodes.dedup();
        let mut rest: Vec<u32> = nodes.into_iter().filter(|n| Some(*n) != first).collect();
        rest.sort_unstable();
        rest.dedup();
        Ok(first.into_iter().chain(rest).collect())
    }

    /// The nodes of a superpixel of this view.
    pub(crate) fn nodes_of(&self, segment: u32) -> Vec<u32> {
        match self.prepared {
            Some(view) => vec![segment + self.index.offsets[view]],
            None => {
                let s = &self.data().segments[segment as usize];
                if s.width > 0.0 { self.index.nodes_at(s.point.into()) } else { Vec::new() }
            }
        }
    }
}
