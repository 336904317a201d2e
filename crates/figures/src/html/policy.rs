//! What a page may do: nothing that was not in it when it was written.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

/// The content security policy (W3C, level 3) of a page in one file as a `<meta>` element. The page runs `script`, the text of
/// its one `<script>` element, shows pictures that it holds, and opens no connection; other scripts do not run, whoever
/// put them there.
pub fn policy_element(script: &str) -> String {
    let hash = STANDARD.encode(Sha256::digest(script));
    format!(
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'sha256-{hash}'; \
         style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:; base-uri 'none'\">"
    )
}

/// The policy of a page that the server itself serves, as the value of a header: what [`policy_element`] allows, and connections
/// to that server alone. No other page may frame it.
pub fn policy_of_server(script: &str) -> String {
    let hash = STANDARD.encode(Sha256::digest(script));
    format!(
        "default-src 'none'; script-src 'sha256-{hash}'; style-src 'unsafe-inline'; img-src 'self' data: blob:; \
         connect-src 'self'; worker-src blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_is_named_by_its_hash() {
        // From the specification: the hash of alert('Hello, world.');
        let element = policy_element("alert('Hello, world.');");
        assert!(
            element.contains("'sha256-qznLcsROx4GACP2dm0UCKCzCG+HiZ1guq6ZZDob/Tng='"),
            "{element}"
        );
    }
}
