//! In a stage crate, the command line, the session and readers of files are named in `src/files/` alone; structs of
//! options, in modules called `options`, derive their flags where they are defined.

use crate::problem::Problem;
use crate::sources::Source;

/// What an algorithm module may not name, and what it is.
const ABOVE: [(&str, &str); 2] = [("clap::", "the command line"), ("motes_stage::", "the session")];

/// `stages` are the crates with a program and a command line.
pub(super) fn check(source: &Source, stages: &[String]) -> Vec<Problem> {
    let Some(module) = module_of(&source.path, stages) else { return Vec::new() };
    let mut problems = Vec::new();
    let tests = module.ends_with("tests.rs") || module.contains("/tests/");
    // Within a statement that names the crates of formats.
    let mut formats = false;
    let own = source.text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    for (line, text) in own.lines().enumerate().take_while(|_| !tests) {
        let code = text.split("//").next().unwrap_or_default();
        formats |= ["motes_formats::", "motes_codecs::"].iter().any(|from| code.contains(from));
        let found = reader(code, formats);
        formats &= !code.contains(';');
        if let Some(reader) = found {
            let text = format!(
                "an algorithm module reads a file ({reader}): move this to src/files/, and pass on what was read"
            );
            problems.push(Problem::error(&source.path, line + 1, text));
        }
    }
    for (line, text) in source.text.lines().enumerate() {
        let code = text.split("//").next().unwrap_or_default();
        let named = ABOVE.iter().filter(|(word, _)| code.contains(word));
        for (word, what) in named.filter(|(word, _)| !(is_options(module) && *word == "clap::")) {
            let text = format!(
                "an algorithm module names {what} ({word}): move this to src/files/ or to options"
            );
            problems.push(Problem::error(&source.path, line + 1, text));
        }
    }
    problems
}

/// What in a line reads files: the file system, or where `formats` are named one of their readers.
fn reader(code: &str, formats: bool) -> Option<&str> {
    if let Some(at) = code.find("std::fs") {
        return Some(&code[at..at + "std::fs".len()]);
    }
    let names = code.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    let reads = |name: &&str| {
        ["read_", "open_", "load_"].iter().any(|verb| name.starts_with(verb))
            && !name.ends_with("_from")
    };
    names.filter(|_| formats).find(reads)
}

/// The path below `src/` of an algorithm module of a stage crate.
fn module_of<'a>(path: &'a str, stages: &[String]) -> Option<&'a str> {
    let (package, module) = path.strip_prefix("crates/")?.split_once("/src/")?;
    let below = module.starts_with("files/") || module == "main.rs" || !module.ends_with(".rs");
    (!below && stages.iter().any(|stage| stage == package)).then_some(module)
}

fn is_options(module: &str) -> bool {
    module.split('/').any(|part| part == "options" || part == "options.rs")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(path: &str, text: &str) -> usize {
        check(&Source { path: path.into(), text: text.into() }, &["render".to_owned()]).len()
    }

    #[test]
    fn algorithms_name_neither_flags_nor_sessions() {
        assert_eq!(problems("crates/render/src/frames/plan.rs", "use clap::Args;\n"), 1);
        assert_eq!(problems("crates/render/src/frames/plan.rs", "use motes_stage::Context;\n"), 1);
        assert_eq!(problems("crates/render/src/frames/plan.rs", "// not clap::Args\n"), 0);
    }

    #[test]
    fn algorithms_read_no_files() {
        let path = "crates/render/src/frames/plan.rs";
        assert_eq!(problems(path, "use motes_formats::ply::{has_faces, read_mesh};\n"), 1);
        assert_eq!(problems(path, "use motes_codecs::{\n    open_gaussians,\n};\n"), 1);
        assert_eq!(problems(path, "let text = std::fs::read_to_string(path)?;\n"), 1);
        assert_eq!(problems(path, "use motes_formats::ply::read_mesh_from;\n"), 0);
        assert_eq!(problems(path, "fn a() {}\n#[cfg(test)]\nmod tests {\n    use std::fs;\n"), 0);
        assert_eq!(problems("crates/render/src/files/command.rs", "use std::fs;\n"), 0);
    }

    #[test]
    fn files_may_name_both_and_options_their_flags() {
        let both = "use clap::Args;\nuse motes_stage::Context;\n";
        assert_eq!(problems("crates/render/src/files/command.rs", both), 0);
        assert_eq!(problems("crates/render/src/main.rs", both), 0);
        assert_eq!(problems("crates/render/src/options.rs", both), 1);
        assert_eq!(problems("crates/render/src/frames/options/look.rs", both), 1);
    }

    #[test]
    fn other_crates_have_rules_of_their_own() {
        assert_eq!(problems("crates/stage/src/run.rs", "use clap::Parser;\n"), 0);
    }
}
