use clap::{CommandFactory, Parser};

use super::*;

#[derive(Parser, Debug, PartialEq)]
#[command(name = "demo")]
struct Args {
    input: Option<PathBuf>,
    #[arg(long)]
    output: PathBuf,
    #[arg(long, default_value_t = 3)]
    sh_degree: u8,
    #[arg(long)]
    random_background: bool,
    #[arg(long)]
    require: Vec<String>,
    #[arg(short, long, action = ArgAction::Count)]
    verbose: u8,
    #[arg(long, num_args = 2)]
    between: Vec<String>,
    #[arg(long)]
    python: Option<String>,
}

fn parse(config: &str, line: &[&str]) -> Result<Args, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("c.json");
    std::fs::write(&path, config).unwrap();
    let line: Vec<OsString> =
        std::iter::once("demo").chain(line.iter().copied()).map(Into::into).collect();
    let merged = merged(&Args::command(), &line, &path).map_err(|e| e.to_string())?;
    Args::try_parse_from(merged.line).map_err(|e| e.to_string())
}

#[test]
fn a_file_can_give_every_kind_of_option() {
    let args = parse(
        r#"{"input": "in.ply", "output": "o.ply", "sh-degree": 1, "random_background": true,
            "require": ["psnr>=1", "ssim>=0"], "verbose": 2,
            "between": ["a.jpg", "b c.jpg"]}"#,
        &[],
    )
    .unwrap();
    let expected = Args {
        input: Some("in.ply".into()),
        output: "o.ply".into(),
        sh_degree: 1,
        random_background: true,
        require: vec!["psnr>=1".into(), "ssim>=0".into()],
        verbose: 2,
        between: vec!["a.jpg".into(), "b c.jpg".into()],
        python: None,
    };
    assert_eq!(args, expected);
}

#[test]
fn flags_win_over_the_file() {
    let file = r#"{"input": "a.ply", "output": "o.ply", "sh_degree": 1, "require": ["psnr>=1"]}"#;
    let args = parse(file, &["--sh-degree", "2", "--require", "psnr>=9", "b.ply"]).unwrap();
    assert_eq!((args.sh_degree, args.require), (2, vec!["psnr>=9".to_owned()]));
    assert_eq!(args.input, Some("b.ply".into()));
    assert_eq!(args.output, PathBuf::from("o.ply"));
}

#[test]
fn nested_groups_read_like_flat_ones() {
    let args = parse(r#"{"output": "o", "options": {"sh_degree": 0}}"#, &[]).unwrap();
    assert_eq!(args.sh_degree, 0);
}

#[test]
fn mistakes_are_named() {
    assert!(parse(r#"{"outptu": 1}"#, &[]).unwrap_err().contains("no option \"outptu\""));
    assert!(parse("[1]", &[]).unwrap_err().contains("not a JSON object"));
    assert!(parse("{", &[]).unwrap_err().contains("not JSON"));
    let wrong_type = parse(r#"{"output": "o", "sh_degree": "many"}"#, &[]).unwrap_err();
    assert!(wrong_type.contains("--sh-degree"), "{wrong_type}");
    let missing = parse("{}", &[]).unwrap_err();
    assert!(missing.contains("--output"), "{missing}");
}

#[test]
fn the_file_is_found_before_the_line_is_parsed() {
    let line = |words: &[&str]| words.iter().map(OsString::from).collect::<Vec<_>>();
    assert_eq!(config_path(&line(&["demo", "--config", "a"])), Some("a".into()));
    assert_eq!(config_path(&line(&["demo", "x", "--config=b"])), Some("b".into()));
    assert_eq!(config_path(&line(&["demo", "--", "--config", "a"])), None);
}

#[test]
fn what_the_file_set_is_known() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("c.json");
    std::fs::write(&path, r#"{"sh-degree": 1, "output": "o.ply"}"#).unwrap();
    let line = ["demo", "--output", "mine.ply"].map(OsString::from);
    let merged = merged(&Args::command(), &line, &path).unwrap();
    assert_eq!(merged.from_config, ["sh_degree"]);
}

#[test]
fn a_file_names_no_program() {
    let file = r#"{"output": "o.ply", "python": "./evil"}"#;
    assert!(parse(file, &[]).unwrap_err().contains("starts none"));
    assert_eq!(parse(file, &["--python", "mine"]).unwrap().python, Some("mine".into()));
    assert_eq!(parse(r#"{"output": "o.ply", "python": null}"#, &[]).unwrap().python, None);
}

#[test]
fn a_preset_sets_what_is_not_given() {
    const PRESETS: &[Preset] = &[("draft", &[("sh-degree", "1"), ("require", "psnr>=1")])];
    #[derive(Parser, Debug)]
    struct Line {
        #[arg(long)]
        preset: Option<String>,
        #[arg(long, default_value_t = 3)]
        sh_degree: u8,
        #[arg(long)]
        require: Vec<String>,
    }
    let parse = |words: &[&str]| {
        let line = std::iter::once("demo").chain(words.iter().copied()).map(Into::into).collect();
        let line = with_preset(&Line::command(), line, PRESETS);
        let Line { preset, sh_degree, require } = Line::try_parse_from(line).unwrap();
        (preset.unwrap_or_default(), sh_degree, require.concat())
    };
    assert_eq!(parse(&["--preset", "draft"]), ("draft".into(), 1, "psnr>=1".into()));
    assert_eq!(parse(&["--sh-degree=2", "--preset=draft"]).1, 2, "the user wins");
    assert_eq!(parse(&["--preset", "high"]).1, 3);
    assert_eq!(parse(&[]), (String::new(), 3, String::new()));
}
