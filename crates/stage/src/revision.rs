//! The commit that a program was built from.
//!
//! The code does not hold it, so that a commit does not rebuild every stage: `make` writes it into a file beside the programs.
//! A file that is older than the program is of another build.

use std::path::Path;
use std::sync::LazyLock;

/// The file beside the programs, and where `make install` puts it.
const FILE: &str = "motes-revision.txt";

/// The short hash of the commit, with `-dirty` for changes on top; none where the build did not say it.
pub(crate) fn git() -> Option<&'static str> {
    static REVISION: LazyLock<Option<String>> = LazyLock::new(|| {
        let program = std::env::current_exe().and_then(|exe| exe.canonicalize()).ok()?;
        beside(&program)
    });
    REVISION.as_deref()
}

fn beside(program: &Path) -> Option<String> {
    let file = program.with_file_name(FILE);
    let written = |path: &Path| std::fs::metadata(path).and_then(|meta| meta.modified()).ok();
    if written(&file)? < written(program)? {
        return None;
    }
    let text = std::fs::read_to_string(&file).ok()?;
    let revision = text.trim();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-._+".contains(c);
    let is_revision =
        !revision.is_empty() && revision.len() <= 80 && revision.chars().all(is_plain);
    is_revision.then(|| revision.to_owned())
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;

    #[test]
    fn a_revision_counts_while_it_is_not_older_than_the_program() {
        let folder = tempfile::tempdir().unwrap();
        let (program, file) = (folder.path().join("render"), folder.path().join(FILE));
        std::fs::write(&program, "").unwrap();
        assert_eq!(beside(&program), None);
        std::fs::write(&file, "abc1234-dirty\n").unwrap();
        assert_eq!(beside(&program).as_deref(), Some("abc1234-dirty"));
        let later = SystemTime::now() + Duration::from_secs(60);
        std::fs::File::options().write(true).open(&program).unwrap().set_modified(later).unwrap();
        assert_eq!(beside(&program), None, "built later, from who knows what");
        std::fs::write(&file, "two words").unwrap();
        assert_eq!(beside(&file), None);
    }
}
