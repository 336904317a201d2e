//! Just enough of shell and make to know which words are commands.

/// A command word and what follows it.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct CommandWord<'a> {
    pub(super) word: &'a str,
    pub(super) next: Option<&'a str>,
}

/// Words after which another command starts.
const PREFIXES: [&str; 12] =
    ["then", "do", "else", "if", "while", "until", "!", "time", "exec", "nohup", "{", "xargs"];

/// The words in command position of one logical shell line (no continuation left).
pub(super) fn command_words(line: &str) -> Vec<CommandWord<'_>> {
    let mut found = Vec::new();
    for part in commands(line) {
        let mut words = part.split_whitespace().peekable();
        while let Some(word) = words.next() {
            let word = word.trim_start_matches(['(', '@', '-', '+']);
            if word.is_empty() || PREFIXES.contains(&word) || is_assignment(word) {
                continue;
            }
            if word.starts_with('#') {
                break;
            }
            found.push(CommandWord {
                word: word.trim_end_matches(')'),
                next: words.peek().copied(),
            });
            break;
        }
    }
    found
}

/// Splits at `;`, `|`, `&`, substitutions and backticks, outside quotes. A substitution inside
/// double quotes is a command too, so only single quotes hide everything.
fn commands(line: &str) -> Vec<&str> {
    let bytes = line.as_bytes();
    let (mut parts, mut start) = (Vec::new(), 0);
    let (mut single, mut double) = (false, false);
    let mut i = 0;
    while i < bytes.len() {
        let mut width = 0;
        match bytes[i] {
            b'\\' => i += 1,
            b'\'' if !double => single = !single,
            b'"' if !single => double = !double,
            _ if single => {}
            b'`' => width = 1,
            b'$' if bytes.get(i + 1) == Some(&b'(') => {
                // `$(NAME)` alone is a make variable.
                let inside = line[i + 2..].split(')').next().unwrap_or_default();
                let variable = inside.chars().all(|c| c.is_ascii_uppercase() || c == '_');
                width = if variable { 0 } else { 2 };
            }
            b';' | b'|' | b'&' if !double => width = 1,
            _ => {}
        }
        if width > 0 {
            parts.push(&line[start..i]);
            start = i + width;
            i = start;
        } else {
            i += 1;
        }
    }
    parts.push(&line[start..]);
    parts
}

fn is_assignment(word: &str) -> bool {
    word.split_once('=').is_some_and(|(name, _)| {
        !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    })
}

/// Lines with their numbers, after joining those that end in a backslash.
pub(super) fn logical_lines(text: &str) -> Vec<(usize, String)> {
    let mut lines: Vec<(usize, String)> = Vec::new();
    let mut open = false;
    for (i, line) in text.lines().enumerate() {
        let (body, continues) = match line.strip_suffix('\\') {
            Some(body) => (body, true),
            None => (line, false),
        };
        match lines.last_mut().filter(|_| open) {
            Some((_, joined)) => joined.push_str(body),
            None => lines.push((i + 1, body.to_owned())),
        }
        open = continues;
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<&str> {
        command_words(line).into_iter().map(|c| c.word).collect()
    }

    #[test]
    fn command_positions_are_found() {
        for (line, expected) in [
            ("export scene.ply -o a", vec!["export"]),
            ("\t@render x", vec!["render"]),
            ("cd a && edit b; render c | tee d", vec!["cd", "edit", "render", "tee"]),
            ("A=1 B=2 render x", vec!["render"]),
            ("if render x; then edit y; fi", vec!["render", "edit", "fi"]),
            ("echo \"$(export a)\" 'x; edit b'", vec!["echo", "export"]),
            ("$(BIN)/export a", vec!["$(BIN)/export"]),
            ("motes export a # render b", vec!["motes"]),
            ("# export a", vec![]),
            ("x=$(render a)", vec!["render"]),
        ] {
            assert_eq!(words(line), expected, "{line}");
        }
    }

    #[test]
    fn continued_lines_are_one() {
        let lines = logical_lines("a \\\n  b\nc\n");
        assert_eq!(lines, [(1, "a   b".to_owned()), (3, "c".to_owned())]);
    }
}
