//! Image names from foreign files.

/// Normalizes a path that a file gives for an image: `/` between parts, no `.` parts.
///
/// # Errors
/// Says why the name is refused: it is empty, absolute, leads upwards, or has control characters other than tabs, which
/// a file name may have.
/// Names are joined to folders and written below the output, so one that leads elsewhere could
/// read or overwrite any file.
pub(crate) fn relative_name(name: &str) -> Result<String, String> {
    let refuse = |why: &str| Err(format!("the image name \"{}\" {why}", name.escape_debug()));
    if name.chars().any(|c| c.is_control() && c != '\t') {
        return refuse("has control characters");
    }
    let drive = name.as_bytes().get(1) == Some(&b':') && name.as_bytes()[0].is_ascii_alphabetic();
    if name.starts_with(['/', '\\']) || drive {
        return refuse("is an absolute path");
    }
    if name.split(['/', '\\']).any(|part| part == "..") {
        return refuse("leads out of the image folder");
    }
    let parts: Vec<&str> =
        name.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
    if parts.is_empty() {
        return refuse("is empty");
    }
    if name.len() > 1024 {
        return refuse("is longer than 1024 bytes");
    }
    Ok(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::relative_name;

    #[test]
    fn names_stay_below_their_folder() {
        assert_eq!(relative_name("./a//b c/ü.jpg").as_deref(), Ok("a/b c/ü.jpg"));
        assert_eq!(relative_name("a..b/c.png").as_deref(), Ok("a..b/c.png"));
        assert_eq!(relative_name("a\tb.png").as_deref(), Ok("a\tb.png"));
        for bad in
            ["", ".", "../x.png", "a/../../x", "/etc/passwd", "C:\\x", "a\\..\\x", "a\0b", "a\nb"]
        {
            assert!(relative_name(bad).is_err(), "{bad:?}");
        }
    }
}
