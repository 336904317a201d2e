//! Operations as flags, in the order of the command line.
//!
//! Every operation is a flag whose value is its most important key, or all of its keys as a JSON object. `--pivot` and `--fill`
//! hold for all operations that know them. `--op` takes a whole operation, which is also how `--dump-config` spells
//! what was given, so that the order survives.

use std::path::Path;

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use motes_formats::selectors::parse_step;
use motes_stage::Context;
use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

use crate::ops::{Flag, OP_FLAGS, OpDocument, Short};
use crate::plan::parse_op;

/// The operations of a command line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpFlags {
    /// In order.
    pub ops: Vec<OpDocument>,
    /// Programs that edit pictures, each after the flag that named it.
    editors: Vec<(&'static str, String)>,
}

impl OpFlags {
    /// Programs that the user typed. What comes from a configuration file is a document like any other.
    pub fn typed_editors(&self, context: &Context) -> Vec<String> {
        let typed = |(flag, _): &&(&str, String)| !context.is_from_config(flag);
        self.editors.iter().filter(typed).map(|(_, command)| command.clone()).collect()
    }
}

impl Serialize for OpFlags {
    /// As the flag `--op` takes them.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(1))?;
        let text = |op| serde_json::to_string(op).unwrap_or_default();
        map.serialize_entry("op", &self.ops.iter().map(text).collect::<Vec<_>>())?;
        map.end()
    }
}

impl Args for OpFlags {
    fn augment_args(command: Command) -> Command {
        let heading = "Operations (applied in command-line order)";
        let mut command = command.next_help_heading(heading);
        for flag in OP_FLAGS.iter().flat_map(|(_, flags, _)| *flags) {
            let mut arg = Arg::new(flag.name)
                .long(flag.name)
                .value_name(flag.value_name)
                .help(flag.help)
                .action(ArgAction::Append)
                .allow_hyphen_values(!flag.alone);
            if flag.alone {
                arg = arg.num_args(0..=1).default_missing_value("");
            }
            command = command.arg(arg);
        }
        let one = |name: &'static str, value: &'static str, help: &'static str| {
            Arg::new(name).long(name).value_name(value).help(help).allow_hyphen_values(true)
        };
        command
            .arg(
                one("op", "JSON", "An operation of a plan, as JSON with all its keys")
                    .action(ArgAction::Append),
            )
            .arg(one(
                "pivot",
                "PIVOT",
                "Fixed point of rotation and scale: origin, centroid (default), base or X,Y,Z",
            ))
            .arg(one(
                "fill",
                "FILL",
                "How to fill uncovered ground: plane (default), patch or none",
            ))
            .arg(one(
                "at",
                "PLACE",
                "Where --insert and --compose stand: VIEW,X,Y (a pixel of a view of --capture) or X,Y,Z; default: free ground",
            ))
            .arg(one("height", "H", "Height that --insert, --compose and --swap give, world units"))
            .arg(one(
                "surroundings",
                "HOW",
                "Ground that an inserted splat brings along: refuse (default), crop or keep",
            ))
            .arg(one(
                "editor",
                "COMMAND",
                "Command line for --stylize, with {input}, {output} and {prompt}; the only one of a plan that is started",
            ))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for OpFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let invalid =
            |text: String| clap::Error::raw(clap::error::ErrorKind::InvalidValue, text + "\n");
        let single = |name| matches.get_one::<String>(name).map(String::as_str);
        let fill = single("fill").map(|fill| json!(fill));
        let editor = single("editor").map(|editor| json!(editor));
        let pivot = match single("pivot") {
            Some(text) if text.contains(',') => {
                Some(json!(numbers("--pivot", text, 3).map_err(invalid)?))
            }
            name => name.map(|name| json!(name)),
        };
        let height = single("height").map(|text| number("--height", text)).transpose();
        let height = height.map_err(invalid)?.map(|height| json!(height));
        let place = single("at").map(place).transpose().map_err(invalid)?;
        let surroundings = single("surroundings").map(|how| json!(how));
        let shared_values = [
            ("pivot", &pivot),
            ("fill", &fill),
            ("editor", &editor),
            ("at", &place),
            ("height", &height),
            ("surroundings", &surroundings),
        ];
        let has_provider = matches.try_contains_id("provider").unwrap_or(false);
        let mut editors: Vec<(&'static str, String)> = Vec::new();
        editors.extend(single("editor").map(|command| ("editor", command.to_owned())));
        let mut note_editor = |flag: &'static str, keys: &Value| {
            let command = keys.get("editor").and_then(Value::as_str);
            editors.extend(command.map(|command| (flag, command.to_owned())));
        };
        let mut found: Vec<(usize, Value)> = Vec::new();
        let all = OP_FLAGS
            .iter()
            .flat_map(|(op, flags, shared)| flags.iter().map(move |flag| (*op, flag, *shared)));
        for (op, flag, shared) in all {
            for (at, text) in occurrences(matches, flag.name) {
                let mut keys = keys_of(flag, text).map_err(invalid)?;
                note_editor(flag.name, &Value::Object(keys.clone()));
                for (key, value) in shared_values {
                    if let Some(value) = value
                        && shared.contains(&key)
                    {
                        keys.entry(key).or_insert_with(|| value.clone());
                    }
                }
                let edits = keys.contains_key("editor") || has_provider;
                if shared.contains(&"editor") && !edits {
                    return Err(invalid(format!(
                        "--{} needs the program that edits pictures: give --provider or --editor",
                        flag.name
                    )));
                }
                keys.insert("op".into(), json!(op));
                found.push((at, Value::Object(keys)));
            }
        }
        let unused = [("at", "--insert or --compose"), ("height", "--insert, --compose or --swap")]
            .into_iter()
            .find(|f| {
                let (flag, _) = f;
                let is_taken = |(_, op): &(usize, Value)| op.get(*flag).is_some();
                single(flag).is_some() && !found.iter().any(is_taken)
            });
        if let Some((flag, of)) = unused {
            return Err(invalid(format!("--{flag} goes with {of}")));
        }
        for (at, text) in occurrences(matches, "op") {
            let value = serde_json::from_str(text)
                .map_err(|error| invalid(format!("--op is not JSON: {error}")))?;
            note_editor("op", &value);
            found.push((at, value));
        }
        found.sort_by_key(|(at, _)| *at);
        let parse = |(i, (_, value)): (usize, (usize, Value))| {
            parse_op(value, &format!("/ops/{i}"), Path::new("the command line"))
        };
        let ops = found.into_iter().enumerate().map(parse).collect::<Result<_, _>>();
        Ok(Self { ops: ops.map_err(|error| invalid(error.to_string()))?, editors })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Places on the command line and values of a flag.
fn occurrences<'m>(matches: &'m ArgMatches, flag: &str) -> Vec<(usize, &'m str)> {
    let values = matches.get_many::<String>(flag).into_iter().flatten();
    let indices = matches.indices_of(flag).into_iter().flatten();
    indices.zip(values.map(String::as_str)).collect()
}

fn keys_of(flag: &Flag, text: &str) -> Result<Map<String, Value>, String> {
    let name = format!("--{}", flag.name);
    let mut keys = Map::new();
    if text.trim_start().starts_with('{') {
        let value: Value = serde_json::from_str(text)
            .map_err(|error| format!("the value of {name} is not JSON: {error}"))?;
        if let Value::Object(given) = value {
            keys = given;
        }
    } else if !text.is_empty() {
        let (key, value) = match flag.short {
            Short::Text(key) => (key, json!(text)),
            Short::Number(key) => {
                let number = match text.trim().parse::<u64>() {
                    Ok(whole) => json!(whole),
                    Err(_) => json!(number(&name, text)?),
                };
                (key, number)
            }
            Short::Numbers(key, n) => (key, json!(numbers(&name, text, n)?)),
            Short::AxisAngle => {
                let v = numbers(&name, text, 4)?;
                ("rotate_axis", json!({ "axis": v[..3], "deg": v[3] }))
            }
            Short::Box => {
                let v = numbers(&name, text, 6)?;
                ("box", json!({ "min": v[..3], "max": v[3..] }))
            }
            Short::Step => ("steps", json!([parse_step(text)?])),
            Short::SelectionFile => ("steps", json!([{ "by": "file", "path": text }])),
            Short::Nothing => {
                return Err(format!(
                    "{name} takes no value but a JSON object, not {text}; --selection FILE or --select STEP before it says what it is about"
                ));
            }
        };
        keys.insert(key.into(), value);
    }
    if let Some((key, value)) = flag.sets {
        keys.entry(key).or_insert_with(|| json!(value));
    }
    Ok(keys)
}

/// `X,Y,Z`, or `VIEW,X,Y`: three numbers are a point.
fn place(text: &str) -> Result<Value, String> {
    if let Ok(point) = numbers("--at", text, 3) {
        return Ok(json!(point));
    }
    let mut parts = text.rsplitn(3, ',');
    let (y, x, view) = (parts.next(), parts.next(), parts.next());
    match (view, x, y) {
        (Some(view), Some(x), Some(y)) if !view.is_empty() => {
            Ok(json!({ "view": view, "pixel": [number("--at", x)?, number("--at", y)?] }))
        }
        _ => Err(format!("--at takes VIEW,X,Y or X,Y,Z: {text}")),
    }
}

fn number(flag: &str, text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| v.is_finite());
    number.ok_or_else(|| format!("{flag}: \"{text}\" is not a finite number"))
}

fn numbers(flag: &str, text: &str, n: usize) -> Result<Vec<f64>, String> {
    let found = text.split(',').map(|part| number(flag, part)).collect::<Result<Vec<_>, _>>()?;
    if found.len() == n {
        return Ok(found);
    }
    Err(format!("{flag} takes {n} numbers, separated by commas: {text}"))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser, Debug)]
    struct Line {
        #[command(flatten)]
        flags: OpFlags,
        #[arg(short)]
        output: Option<String>,
    }

    fn line(text: &str) -> Result<Vec<OpDocument>, clap::Error> {
        let words = std::iter::once("edit").chain(text.split_whitespace());
        Line::try_parse_from(words).map(|line| line.flags.ops)
    }

    fn names(ops: &[OpDocument]) -> Vec<&str> {
        ops.iter().map(OpDocument::name).collect()
    }

    #[test]
    fn flags_keep_their_order() {
        let ops = line("--scale 2 --selection s.json --translate -0.02,0.34,0 --delete --fill plane --scale 0.5 -o x").unwrap();
        assert_eq!(names(&ops), ["transform", "select", "transform", "delete", "transform"]);
        let json = serde_json::to_value(&ops).unwrap();
        assert_eq!(json[2]["translate"], json!([-0.02, 0.34, 0.0]));
        assert_eq!((&json[3]["fill"], &json[4]["scale"]), (&json!("plane"), &json!(0.5)));
    }

    #[test]
    fn what_is_dumped_reads_back() {
        let ops = line("--select sphere=0,0,1,0.5 --rotate-axis 0,0,1,30 --pivot base --set-material {\"roughness\":0.5} --merge a.ply --undo").unwrap();
        let dumped =
            serde_json::to_value(OpFlags { ops: ops.clone(), ..OpFlags::default() }).unwrap();
        let mut words = vec!["edit".to_owned()];
        for op in dumped["op"].as_array().unwrap() {
            words.push(format!("--op={}", op.as_str().unwrap()));
        }
        assert_eq!(Line::try_parse_from(words).unwrap().flags.ops, ops);
        assert_eq!(names(&ops), ["select", "transform", "set_material", "insert", "undo"]);
    }

    #[test]
    fn every_operation_has_a_flag_and_mistakes_are_named() {
        for (op, flags, _) in OP_FLAGS {
            assert!(!flags.is_empty(), "{op}");
        }
        for (text, says) in [
            ("--scale NaN", "is not a finite number"),
            ("--translate 1,2", "takes 3 numbers"),
            ("--delete ball", "takes no value"),
            ("--stylize autumn", "give --provider or --editor"),
            ("--op {\"op\":\"explode\"}", "there is no operation"),
            ("--set-material {\"ruffness\":1}", "ruffness"),
            ("--select magic=1", "magic"),
        ] {
            let error = line(text).unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
