//! Line plots as SVG text: axes with round ticks, a legend, light and dark by CSS classes.

use std::fmt::Write as _;

/// A plot of one or more series over common axes.
#[derive(Clone, Debug, Default)]
pub struct LinePlot {
    /// Said to readers who cannot see the picture, and drawn on top.
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x_label: String,
    /// Name and unit of the vertical axis.
    pub y_label: String,
    /// Curves, drawn in this order.
    pub series: Vec<Series>,
}

/// One curve.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Legend text.
    pub name: String,
    /// Points from left to right; points that are not finite interrupt the line.
    pub points: Vec<(f64, f64)>,
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 46.0;
/// Readable on white and on black, and told apart by the common kinds of color blindness.
const COLORS: [&str; 6] = ["#0b84c6", "#d9730d", "#1f9d72", "#c2478e", "#8a6fd1", "#7a7a00"];

impl LinePlot {
    /// The plot as an `<svg>` element. `None` when no series has a finite point.
    pub fn to_svg(&self) -> Option<String> {
        let finite = || {
            let points = self.series.iter().flat_map(|series| &series.points);
            points.filter(|(x, y)| x.is_finite() && y.is_finite())
        };
        finite().next()?;
        let x_ticks = round_ticks(finite().map(|p| p.0), 7);
        let y_ticks = round_ticks(finite().map(|p| p.1), 6);
        let to_x = |x: f64| LEFT + (WIDTH - LEFT - RIGHT) * x_ticks.position(x);
        let to_y = |y: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * y_ticks.position(y);

        let mut svg = format!(
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{0}\">\
             <title>{0}</title><text class=\"plot-title\" x=\"{LEFT}\" y=\"18\">{0}</text>",
            escape(&self.title)
        );
        let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        for x in x_ticks.values() {
            let (at, label) = (to_x(x), x_ticks.label(x));
            let _ = write!(
                svg,
                "<path class=\"tick\" d=\"M{at:.1} {TOP}V{bottom}\"/>\
                 <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
                bottom + 16.0
            );
        }
        for y in y_ticks.values() {
            let (at, label) = (to_y(y), y_ticks.label(y));
            let _ = write!(
                svg,
                "<path class=\"tick\" d=\"M{LEFT} {at:.1}H{right}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                LEFT - 6.0,
                at + 4.0
            );
        }
        let _ = write!(
            svg,
            "<path class=\"axis\" d=\"M{LEFT} {TOP}V{bottom}H{right}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text x=\"14\" y=\"{:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {:.1})\">{}</text>",
            (LEFT + right) / 2.0,
            HEIGHT - 8.0,
            escape(&self.x_label),
            (TOP + bottom) / 2.0,
            (TOP + bottom) / 2.0,
            escape(&self.y_label),
        );
        for (i, series) in self.series.iter().enumerate() {
            draw_series(&mut svg, series, COLORS[i % COLORS.len()], &to_x, &to_y);
        }
        self.draw_legend(&mut svg, right);
        svg.push_str("</svg>");
        Some(svg)
    }

    fn draw_legend(&self, svg: &mut String, right: f64) {
        if self.series.len() < 2 {
            return;
        }
        let mut x = right;
        for (i, series) in self.series.iter().enumerate().rev() {
            x -= 7.0 * series.name.chars().count() as f64 + 34.0;
            let _ = write!(
                svg,
                "<path d=\"M{x:.1} 14h18\" stroke=\"{}\" stroke-width=\"3\" fill=\"none\"/>\
                 <text x=\"{:.1}\" y=\"18\">{}</text>",
                COLORS[i % COLORS.len()],
                x + 23.0,
                escape(&series.name)
            );
        }
    }
}

fn draw_series(
    svg: &mut String,
    series: &Series,
    color: &str,
    to_x: &impl Fn(f64) -> f64,
    to_y: &impl Fn(f64) -> f64,
) {
    let mut path = String::new();
    let mut drawing = false;
    for &(x, y) in &series.points {
        if x.is_finite() && y.is_finite() {
            let command = if drawing { 'L' } else { 'M' };
            let _ = write!(path, "{command}{:.1} {:.1}", to_x(x), to_y(y));
        }
        drawing = x.is_finite() && y.is_finite();
    }
    let _ = write!(
        svg,
        "<path d=\"{path}\" stroke=\"{color}\" stroke-width=\"2\" fill=\"none\" stroke-linejoin=\"round\"/>"
    );
    if series.points.len() <= 60 {
        for &(x, y) in series.points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
            let (at_x, at_y) = (to_x(x), to_y(y));
            let _ = write!(
                svg,
                "<circle cx=\"{at_x:.1}\" cy=\"{at_y:.1}\" r=\"3\" fill=\"{color}\">\
                 <title>{}: {x}, {y:.4}</title></circle>",
                escape(&series.name)
            );
        }
    }
}

/// Multiples of `step` that cover the data.
struct Ticks {
    first: i64,
    last: i64,
    step: f64,
}

/// At most about `count` ticks at multiples of 1, 2 or 5 times a power of ten.
fn round_ticks(values: impl Iterator<Item = f64>, count: usize) -> Ticks {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        low = low.min(value);
        high = high.max(value);
    }
    // A constant series still needs a span; one part in a thousand keeps huge values drawable.
    let span = (high - low).max(1e-3 * high.abs().max(low.abs())).max(1e-9);
    let raw = span / count as f64;
    let magnitude = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * magnitude).into_iter().find(|&s| s >= raw);
    let step = step.unwrap_or(10.0 * magnitude);
    let first = (low / step + 1e-9).floor() as i64;
    let last = ((high / step - 1e-9).ceil() as i64).max(first + 1);
    Ticks { first, last, step }
}

impl Ticks {
    fn values(&self) -> impl Iterator<Item = f64> {
        (self.first..=self.last).map(|i| i as f64 * self.step)
    }

    /// Where a value lies between the first (0) and the last tick (1).
    fn position(&self, value: f64) -> f64 {
        (value / self.step - self.first as f64) / (self.last - self.first) as f64
    }

    fn label(&self, value: f64) -> String {
        let decimals = (-self.step.log10() - 1e-9).ceil().max(0.0) as usize;
        if value.abs() >= 1e6 { format!("{value:.1e}") } else { format!("{value:.decimals$}") }
    }
}

/// Text that is safe inside an element and inside a quoted attribute.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(values: &[f64]) -> Vec<String> {
        let ticks = round_ticks(values.iter().copied(), 6);
        ticks.values().map(|v| ticks.label(v)).collect()
    }

    #[test]
    fn ticks_are_round_and_cover_the_data() {
        assert_eq!(ticks(&[21.3, 24.9]), ["21", "22", "23", "24", "25"]);
        assert_eq!(
            ticks(&[0.0, 30_000.0]),
            ["0", "5000", "10000", "15000", "20000", "25000", "30000"]
        );
        assert_eq!(ticks(&[0.61, 0.68]), ["0.60", "0.62", "0.64", "0.66", "0.68"]);
        assert_eq!(ticks(&[5.0, 5.0]).len(), 2);
    }

    #[test]
    fn points_are_mapped_and_gaps_break_the_line() {
        let plot = LinePlot {
            title: "a < b".into(),
            series: vec![Series {
                name: "s".into(),
                points: vec![(0.0, 0.0), (1.0, f64::NAN), (2.0, 5.0), (3.0, 6.0)],
            }],
            ..LinePlot::default()
        };
        let svg = plot.to_svg().unwrap();
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN"));
        let line = svg.split("d=\"").find(|s| s.contains('L') && !s.contains('H')).unwrap();
        let line = &line[..line.find('"').unwrap()];
        assert_eq!(line.matches('M').count(), 2, "{line}");
        assert_eq!(line.matches('L').count(), 1, "{line}");
        assert!(line.starts_with(&format!("M{LEFT:.1} {:.1}", HEIGHT - BOTTOM)), "{line}");
    }

    #[test]
    fn nothing_to_draw_is_none() {
        assert!(LinePlot::default().to_svg().is_none());
    }
}
