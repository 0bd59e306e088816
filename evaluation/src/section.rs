//! Sections of a results file: one for each command, under a heading that is the command.

/// `page` with the section of `command` replaced, or with a new one at its end.
pub fn replaced(page: &str, command: &str, section: &str) -> String {
    let heading = format!("## `{command}`");
    let lines: Vec<&str> = page.lines().collect();
    let begin = lines.iter().position(|line| *line == heading);
    let end = begin.map_or(lines.len(), |begin| {
        let rest = lines[begin + 1..].iter().position(|line| line.starts_with("## "));
        rest.map_or(lines.len(), |count| begin + 1 + count)
    });
    let before = lines[..begin.unwrap_or(lines.len())].join("\n");
    let after = lines[end..].join("\n");
    let parts = [before.trim_end(), &heading, section, after.trim_end()];
    let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join("\n\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::replaced;

    #[test]
    fn a_command_replaces_its_own_section_alone() {
        let page = "# Results\n\n## `a`\n\nold\n\n## By hand\n\nkept\n";
        let expected = "# Results\n\n## `a`\n\nnew\n\n## By hand\n\nkept\n";
        assert_eq!(replaced(page, "a", "new"), expected);
        let longer = format!("{expected}\n## `b`\n\nmore\n");
        assert_eq!(replaced(expected, "b", "more"), longer);
    }
}
