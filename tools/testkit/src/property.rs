//! Property tests: the same cases on every run, shrunk to the smallest failing one.

use std::fmt::Debug;

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};

/// Checks `test` on `cases` values of `strategy`; a failure names the smallest value found.
///
/// The values are the same on every run, so that a build does not fail by luck.
/// `MOTES_STABILITY_CASES=20000` looks at that many, `MOTES_STABILITY_SEED=7` at others.
///
/// # Panics
/// When the property does not hold.
pub fn check_property<S: Strategy<Value: Debug>>(
    cases: u32,
    strategy: &S,
    test: impl Fn(S::Value) -> Result<(), TestCaseError>,
) {
    let from_environment = |name: &str| std::env::var(name).ok().and_then(|v| v.parse().ok());
    let config = Config {
        cases: from_environment("MOTES_STABILITY_CASES").unwrap_or(cases),
        failure_persistence: None,
        max_shrink_iters: 2000,
        ..Config::default()
    };
    let mut seed = [0; 32];
    let number = from_environment("MOTES_STABILITY_SEED").unwrap_or(0);
    seed[..4].copy_from_slice(&number.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
    match TestRunner::new_with_rng(config, rng).run(strategy, test) {
        Ok(()) => {}
        Err(TestError::Fail(why, value)) => panic!("{why}\nsmallest failing case: {value:#?}"),
        Err(TestError::Abort(why)) => panic!("too many cases were rejected: {why}"),
    }
}
