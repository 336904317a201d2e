//! The page: the viewer of `export`, and the panel that edits.

use export::html::{PageParts, ServedPage};

const PARTS: PageParts<'static> = PageParts {
    style: include_str!("edit.css"),
    body: include_str!("edit.html"),
    keys: include_str!("keys.html"),
    script: concat!(
        include_str!("source.js"),
        include_str!("handles.js"),
        include_str!("tools.js"),
        include_str!("sky.js"),
        include_str!("panel.js"),
        include_str!("live.js")
    ),
};

/// The page under a title, and its content security policy.
pub fn page(title: &str) -> ServedPage {
    ServedPage::new(title, &PARTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_whole_and_names_no_other_site() {
        let page = page("a <scene>");
        assert!(!page.html.contains("{{") && page.html.ends_with("</html>\n"));
        assert!(page.html.contains("a &lt;scene&gt;"));
        for outside in ["http:", "https:", "//cdn", "import("] {
            assert!(!page.html.contains(outside), "the page contains {outside}");
        }
        assert!(page.policy.contains("connect-src 'self'"), "{}", page.policy);
        assert!(!page.policy.contains("unsafe-eval"), "{}", page.policy);
    }
}
