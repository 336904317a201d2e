//! Damaged files of every kind.

use std::time::{Duration, Instant};

use crate::bench::{Bench, say};
use crate::cases;
use crate::judge::fault;
use crate::mutate::Mutator;

/// Goes through all cases again and again, for so long, and through each of them once whatever it takes.
pub(crate) fn run(bench: &mut Bench, minutes: f64) -> anyhow::Result<()> {
    let began = Instant::now();
    let time = Duration::from_secs_f64(60.0 * minutes.max(0.0));
    let cases = cases::prepare(bench)?;
    let seeds: Vec<Vec<Vec<u8>>> =
        cases.iter().map(|case| case.seeds(bench)).collect::<Result<_, _>>()?;
    let mut mutator = Mutator::new(bench.seed);
    let mut rounds = 0;
    while rounds == 0 || began.elapsed() < time {
        for (case, seeds) in cases.iter().zip(&seeds) {
            if rounds > 0 && began.elapsed() > time {
                break;
            }
            let run = bench.clear()?;
            let at = bench.path(case.at);
            let before = std::fs::read(&at).ok();
            std::fs::write(&at, mutator.mutate(seeds))?;
            let ended = bench.run(case.line)?;
            if let Some(what) = fault(&ended, &run) {
                bench.fail(case.line, &what, Some(&at));
            }
            match before {
                Some(bytes) => std::fs::write(&at, bytes)?,
                None => std::fs::remove_file(&at)?,
            }
        }
        rounds += 1;
    }
    say(&format!("mutations: {rounds} rounds of {} cases", cases.len()));
    Ok(())
}
