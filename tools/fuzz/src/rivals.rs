//! Two runs with one output.

use std::collections::BTreeSet;
use std::time::Duration;

use crate::bench::{Bench, say, wait};
use crate::judge::{first_line, leftovers};

const ROUNDS: usize = 6;
const GRANTED: Duration = Duration::from_secs(60);

pub(crate) fn run(bench: &mut Bench) -> anyhow::Result<()> {
    for round in 0..ROUNDS {
        one_wins(bench, round)?;
        scenes_do_not_mix(bench)?;
    }
    say(&format!("rivals: {ROUNDS} rounds"));
    Ok(())
}

/// Without `--overwrite` one of two succeeds, the other says that it was late and replaces nothing.
fn one_wins(bench: &mut Bench, round: usize) -> anyhow::Result<()> {
    let run = bench.clear()?;
    let line = |scale: &'static str| {
        [
            "edit",
            "--gaussians",
            "true.ply",
            "--scale",
            scale,
            "-o",
            "run/product.ply",
            "--no-provenance",
        ]
    };
    let lines = [line("2"), line("3")];
    let children: Vec<_> = lines.iter().map(|l| bench.start(l)).collect::<Result<_, _>>()?;
    let mut codes = Vec::new();
    for (child, line) in children.into_iter().zip(&lines) {
        bench.count();
        let ended = wait(child, GRANTED)?;
        let code = ended.status.and_then(|status| status.code());
        if !matches!(code, Some(0 | 2)) {
            let what = format!("{code:?} beside a rival: {}", first_line(&ended.stderr));
            bench.fail(line, &what, None);
        }
        codes.push(code);
    }
    // One may have begun after the other ended, and then it is refused at once.
    let winners = codes.iter().filter(|code| **code == Some(0)).count();
    if winners != 1 {
        bench.fail(&lines[0], &format!("round {round}: {winners} of two runs succeeded"), None);
    }
    if let Some(left) = leftovers(&run) {
        bench.fail(&lines[0], &left, None);
    }
    Ok(())
}

/// Two runs that both may overwrite leave the files of one of them.
fn scenes_do_not_mix(bench: &mut Bench) -> anyhow::Result<()> {
    bench.clear()?;
    let edited = |scale: &'static str, to: &'static str| {
        [
            "edit",
            "--scene",
            "{scene}",
            "--scale",
            scale,
            "--no-reshade",
            "-w",
            "-o",
            to,
            "--no-provenance",
        ]
    };
    let mut whole = Vec::new();
    for (scale, to) in [("2", "run/two"), ("3", "run/three")] {
        let line = edited(scale, to);
        let ended = bench.run(&line)?;
        if !ended.status.is_some_and(|status| status.success()) {
            bench.fail(&line, &first_line(&ended.stderr), None);
            return Ok(());
        }
        whole.push(digest(bench, to)?);
    }
    let lines = [edited("2", "run/both"), edited("3", "run/both")];
    let children: Vec<_> = lines.iter().map(|l| bench.start(l)).collect::<Result<_, _>>()?;
    for (child, line) in children.into_iter().zip(&lines) {
        bench.count();
        let ended = wait(child, GRANTED)?;
        if !ended.status.is_some_and(|status| status.success()) {
            bench.fail(line, &format!("beside a rival: {}", first_line(&ended.stderr)), None);
        }
    }
    if !whole.contains(&digest(bench, "run/both")?) {
        bench.fail(&lines[0], "the scene folder has files of both runs", None);
    }
    Ok(())
}

/// Files of a scene folder, without what names its place.
fn digest(bench: &Bench, folder: &str) -> anyhow::Result<BTreeSet<(String, Vec<u8>)>> {
    let files = ["gaussians.ply", "surface.ply", "environment.exr"];
    let read = |name: &str| Ok((name.to_owned(), std::fs::read(bench.path(folder).join(name))?));
    files.into_iter().map(read).collect()
}
