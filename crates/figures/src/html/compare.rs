//! Pictures of one view to flip and slide between.

use std::fmt::Write as _;

use crate::svg_plot::escape;

/// Pictures of equal size, one on top of the other. Radio buttons choose the upper one, a slider
/// uncovers the first one from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Name of the view.
    pub name: String,
    /// One line under the pictures.
    pub caption: String,
    /// The first is what the others are compared with.
    pub layers: Vec<Layer>,
    /// Index of the layer that shows at first.
    pub selected: usize,
}

/// One picture of a [`Comparison`].
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Text of its button.
    pub label: String,
    /// Said to readers who cannot see it.
    pub description: String,
    /// Data URL.
    pub url: String,
}

impl Comparison {
    pub(super) fn write_html(&self, out: &mut String, number: usize) {
        let name = escape(&self.name);
        let _ = writeln!(out, "<figure class=\"compare\"><div class=\"stack\">");
        for (i, layer) in self.layers.iter().enumerate() {
            let class = match i {
                0 => "base",
                i if i == self.selected => "top shown",
                _ => "top",
            };
            let _ = writeln!(
                out,
                "<img class=\"{class}\" src=\"{}\" alt=\"{}\">",
                layer.url,
                escape(&layer.description)
            );
        }
        let _ = writeln!(out, "</div><fieldset><legend class=\"sr\">Picture of {name}</legend>");
        for (i, layer) in self.layers.iter().enumerate() {
            let checked = if i == self.selected { " checked" } else { "" };
            let _ = write!(
                out,
                "<label><input type=\"radio\" name=\"layer{number}\" value=\"{i}\"{checked}>\
                 <span>{}</span></label>",
                escape(&layer.label)
            );
        }
        let first = self.layers.first().map_or("", |layer| &layer.label);
        let _ = writeln!(
            out,
            "<input type=\"range\" min=\"0\" max=\"100\" value=\"0\" \
             aria-label=\"Uncover {0} from the left, percent\" title=\"Uncover {0}\"></fieldset>\
             <figcaption><strong>{name}</strong> {1}</figcaption></figure>",
            escape(first),
            escape(&self.caption)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_layer_is_shown_and_checked() {
        let layer = |label: &str| Layer {
            label: label.into(),
            description: format!("{label} of v"),
            url: "data:,".into(),
        };
        let comparison = Comparison {
            name: "a\"b".into(),
            caption: "24.0 dB".into(),
            layers: vec![layer("photo"), layer("render"), layer("error")],
            selected: 1,
        };
        let mut html = String::new();
        comparison.write_html(&mut html, 7);
        assert_eq!(html.matches("shown").count(), 1);
        assert_eq!(html.matches(" checked").count(), 1);
        assert!(html.contains("value=\"1\" checked") && html.contains("name=\"layer7\""));
        assert!(html.contains("a&quot;b") && !html.contains("a\"b"));
        assert_eq!(html.matches("alt=\"").count(), 3);
    }
}
