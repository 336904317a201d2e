//! Help, manual pages and completions.

use super::*;

#[test]
fn help_is_complete_and_on_stdout() {
    for stage in stages() {
        let output = Bench::of(&stage).run(&["--help"]);
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), ""), "{stage}");
        let help = stdout(&output);
        for flag in ["overwrite", "threads", "quiet", "progress", "json", "dry-run", "config"] {
            assert!(help.contains(&format!("--{flag}")), "{stage} has no --{flag}");
        }
        assert!(help.contains(&format!("Usage: {stage}")), "{stage}: {help}");
        let flags = help.split("--").skip(1).map(|rest| {
            rest.split(|c: char| !(c.is_alphanumeric() || c == '-' || c == '_')).next().unwrap()
        });
        for flag in flags {
            let kebab = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            assert!(flag.chars().all(kebab), "{stage}: --{flag} is not kebab-case");
        }
    }
}

#[test]
fn short_help_fits_on_a_page_and_long_help_has_every_flag() {
    for stage in stages() {
        let flags = |help: &str| {
            let words = help.lines().filter(|line| line.trim_start().starts_with('-'));
            words.count()
        };
        let (short, long) = (Bench::of(&stage).run(&["-h"]), Bench::of(&stage).run(&["--help"]));
        let (short, long) = (stdout(&short), stdout(&long));
        assert!(flags(short) <= 16, "{stage}: {} flags\n{short}", flags(short));
        assert!(flags(short) <= flags(long), "{stage}");
        assert!(flags(short) == flags(long) || short.contains("more options"), "{stage}: {short}");
    }
}

/// Groups of flags, the same in all stages.
const GROUPS: &[&str] = &[
    "Arguments",
    "Options",
    "Baking",
    "Cameras",
    "Exposures",
    "HTML page",
    "Image",
    "Initialization",
    "Known quantities",
    "Lifting relit views",
    "Light",
    "Mesh",
    "Mirror ball",
    "Model",
    "Objects",
    "Operations (applied in command-line order)",
    "Outputs",
    "Pipeline",
    "Prompts",
    "Protocol",
    "Provider (expert)",
    "Quality",
    "Schedule",
    "Server",
    "Shadow plane",
    "Splat",
    "Splat formats",
    "Structure from motion",
    "Verification",
    "Video",
    "Common options",
    "Densification (expert)",
    "Fit (expert)",
    "Learning rates (expert)",
    "Lifting relit views (expert)",
    "Loss (expert)",
    "Optimizer (expert)",
    "Priors (expert)",
    "Rasterizer (expert)",
    "Sampling (expert)",
    "Initialization (expert)",
    "Regularization (expert)",
    "Splat compression (expert)",
    "Surface reconstruction (expert)",
];

#[test]
fn expert_groups_come_last_and_groups_have_one_name_in_all_stages() {
    for stage in stages() {
        let output = Bench::of(&stage).run(&["--help"]);
        let help = stdout(&output);
        let is_heading = |line: &&str| !line.starts_with(' ') && line.ends_with(':');
        let headings: Vec<&str> = help.lines().filter(is_heading).collect();
        let groups = headings.iter().map(|line| line.trim_end_matches(':'));
        let groups: Vec<&str> = groups.filter(|group| *group != "Examples").collect();
        for group in &groups {
            assert!(
                GROUPS.contains(group),
                "{stage}: \"{group}\" is not among the groups of the suite"
            );
        }
        let common = groups.iter().position(|group| *group == "Common options").unwrap();
        for (i, group) in groups.iter().enumerate() {
            let is_expert = group.ends_with("(expert)");
            assert_eq!(is_expert, i > common, "{stage}: {groups:?}");
        }
    }
}

/// Commands of a program in the Examples of a help: indented by four, longer ones are wrapped.
fn examples(help: &str, stage: &str) -> Vec<Vec<String>> {
    let (_, text) = help.split_once("\nExamples:\n").unwrap_or_else(|| panic!("{stage}: {help}"));
    let mut commands: Vec<String> = Vec::new();
    let program = |word: &str| word == "motes" || stages().iter().any(|s| s.starts_with(word));
    for line in text.lines().filter_map(|line| line.strip_prefix("    ")) {
        match (program(line.split(' ').next().unwrap()), commands.last_mut()) {
            (false, Some(last)) => *last += &format!(" {line}"),
            _ => commands.push(line.to_owned()),
        }
    }
    let of_stage = |line: &&String| line.starts_with(&format!("{stage} "));
    commands.iter().filter(of_stage).map(|line| words(line)).collect()
}

/// Words as a shell sees them: spaces part them outside of single quotes.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut is_quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match (c, words.last_mut()) {
            ('\'', _) => is_quoted = !is_quoted,
            (' ', _) if !is_quoted => words.push(String::new()),
            (c, Some(word)) => word.push(c),
            (_, None) => {}
        }
    }
    words
}

#[test]
fn examples_in_the_help_are_command_lines_that_parse() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        let help = bench.run(&["--help"]);
        let examples = examples(stdout(&help), &stage);
        assert!((2..=6).contains(&examples.len()), "{stage}: {examples:?}");
        for example in examples {
            let words: Vec<&str> = example.iter().map(String::as_str).collect();
            let arguments = &words[stage.split(' ').count()..];
            let output = bench.run(&[arguments, &["--dump-config"]].concat());
            assert!(output.status.success(), "{words:?}: {}", stderr(&output));
        }
    }
}

#[test]
fn the_stage_knows_its_name_and_says_one_line_about_itself() {
    for stage in stages() {
        let bench = Bench::of(&stage);
        let version = bench.run(&["--version"]);
        assert!(stdout(&version).starts_with(&format!("{stage} 0.")), "{}", stdout(&version));
        let summary = bench.run(&["--summary"]);
        let line = stdout(&summary).trim_end();
        assert!((15..=100).contains(&line.len()) && !line.ends_with('.'), "{stage}: {line:?}");
        assert_eq!(line.lines().count(), 1, "{stage}: {line:?}");
    }
}

#[test]
fn manual_and_completions_are_generated() {
    for stage in stages() {
        for what in ["man", "bash", "zsh", "fish"] {
            let output = Bench::of(&stage).run(&["--generate", what]);
            // A shell completes one word: the subject of a program stands behind a hyphen.
            let name = if what == "man" { stage.clone() } else { stage.replace(' ', "-") };
            assert!(output.status.success() && stdout(&output).contains(&name), "{stage} {what}");
        }
    }
}
