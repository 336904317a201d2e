//! Names of files for names of views.

use std::collections::HashSet;

/// The same names, but those that were given before with a number behind them: `a`, `a_2`, `a_3`.
pub fn told_apart(names: Vec<String>) -> Vec<String> {
    let mut given: HashSet<String> = names.iter().cloned().collect();
    let mut used = HashSet::new();
    let apart = |name: String| {
        if used.insert(name.clone()) {
            return name;
        }
        let mut candidates = (2u64..).map(|n| format!("{name}_{n}"));
        let free = candidates.find(|candidate| given.insert(candidate.clone()));
        free.unwrap_or(name)
    };
    names.into_iter().map(apart).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_share_a_file_get_numbers() {
        let names = ["a", "b", "a", "a_2", "a", "A"].map(String::from).to_vec();
        assert_eq!(told_apart(names), ["a", "b", "a_3", "a_2", "a_4", "A"]);
    }
}
