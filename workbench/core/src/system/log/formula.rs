//! What the right side of `--columns OURS=…` computes from the columns of a file.

use exmex::{Express, FlatEx};

/// A column, a column times a factor, a constant, or an expression over several columns.
#[derive(Clone, Debug)]
pub enum Formula {
    /// One column times a factor: exactly what a multiplication gives.
    Scaled {
        /// Index of the column.
        index: usize,
        /// Factor, not 0.
        factor: f64,
    },
    /// Everything else.
    Expression {
        /// Over the variables `#0`, `#1`, …
        expression: Box<FlatEx<f64>>,
        /// Index of the column of each variable, in the expression's order.
        indices: Vec<usize>,
    },
}

/// A text that is neither a column nor an expression over columns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unreadable {
    /// This name is no column of the file.
    NoColumn(String),
    /// It cannot be computed.
    Broken(String),
}

impl Formula {
    /// Reads `NAME`, `NAME*FACTOR`, or an expression over the names of a header. Names that are no words stand in quotes, or as
    /// they are in the header.
    pub fn read(text: &str, header: &[String]) -> Result<Self, Unreadable> {
        let column = |name: &str| header.iter().position(|known| known == unquoted(name));
        if let Some(index) = column(text) {
            return Ok(Self::Scaled { index, factor: 1.0 });
        }
        if let Some((name, factor)) = text.rsplit_once('*')
            && let (Some(index), Ok(factor)) = (column(name), factor.trim().parse::<f64>())
        {
            return Ok(Self::Scaled { index, factor });
        }
        let replaced = with_variables(text, header)?;
        let broken = |error: exmex::ExError| Unreadable::Broken(error.to_string());
        let expression = Box::new(FlatEx::<f64>::parse(&replaced).map_err(broken)?);
        let index = |name: &String| {
            let number = name.strip_prefix('#').and_then(|number| number.parse().ok());
            number.ok_or_else(|| Unreadable::NoColumn(name.clone()))
        };
        let indices = expression.var_names().iter().map(index).collect::<Result<_, _>>()?;
        Ok(Self::Expression { expression, indices })
    }

    /// The columns that it is computed from.
    pub fn indices(&self) -> &[usize] {
        match self {
            Self::Scaled { index, .. } => std::slice::from_ref(index),
            Self::Expression { indices, .. } => indices,
        }
    }

    /// Its value times `unit`, from the values of [`Self::indices`].
    pub fn value(&self, cells: &[f64], unit: f64) -> f64 {
        match self {
            // One product of the factors, as the format has always computed it.
            Self::Scaled { factor, .. } => cells[0] * (unit * factor),
            Self::Expression { expression, .. } => {
                expression.eval(cells).map_or(f64::NAN, |value| value * unit)
            }
        }
    }
}

/// A text without the quotes around it.
pub fn unquoted(text: &str) -> &str {
    let text = text.trim();
    let within =
        |quote: char| text.strip_prefix(quote)?.strip_suffix(quote).filter(|rest| !rest.contains(quote));
    within('"').or_else(|| within('\'')).unwrap_or(text)
}

/// The expression with `{#k}` in place of the name of column k; a quoted name must be one.
fn with_variables(text: &str, header: &[String]) -> Result<String, Unreadable> {
    if text.contains(['{', '}']) {
        return Err(Unreadable::Broken("braces have no meaning; use ( and )".into()));
    }
    let mut longest_first: Vec<usize> = (0..header.len()).filter(|k| !header[*k].is_empty()).collect();
    longest_first.sort_by_key(|k| std::cmp::Reverse(header[*k].len()));
    let (mut rest, mut replaced, mut before) = (text, String::new(), ' ');
    while let Some(first) = rest.chars().next() {
        if (first == '"' || first == '\'')
            && let Some(end) = rest[1..].find(first)
        {
            let name = &rest[1..=end];
            let index = header.iter().position(|known| known == name);
            replaced += &format!("{{#{}}}", index.ok_or_else(|| Unreadable::NoColumn(name.into()))?);
            rest = &rest[end + 2..];
            continue;
        }
        let named = |k: &&usize| {
            !is_word(before)
                && rest.starts_with(&header[**k])
                && ends(&rest[header[**k].len()..], &header[**k])
        };
        if let Some(index) = longest_first.iter().find(named) {
            replaced += &format!("{{#{index}}}");
            rest = &rest[header[*index].len()..];
            before = ' ';
            continue;
        }
        replaced.push(first);
        before = first;
        rest = &rest[first.len_utf8()..];
    }
    Ok(replaced)
}

fn is_word(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_' || letter == '.'
}

/// A name ends where no letter goes on with it.
fn ends(rest: &str, name: &str) -> bool {
    !name.ends_with(is_word) || !rest.starts_with(is_word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str, cells: &[f64]) -> Result<f64, Unreadable> {
        let header = ["t", "pwm", "Speed (rpm, raw)", "e", "2nd"].map(String::from);
        let formula = Formula::read(text, &header)?;
        let cells: Vec<f64> = formula.indices().iter().map(|index| cells[*index]).collect();
        Ok(formula.value(&cells, 1.0))
    }

    #[test]
    fn columns_and_expressions_are_computed() {
        let cells = [2.0, 51.0, 60.0, 7.0, 5.0];
        let cases = [
            ("pwm", 51.0),
            ("pwm*2", 102.0),
            ("pwm/255*12", 2.4),
            ("12", 12.0),
            ("-t", -2.0),
            ("\"Speed (rpm, raw)\"/60", 1.0),
            ("'Speed (rpm, raw)'", 60.0),
            ("Speed (rpm, raw)*0.5", 30.0),
            ("(pwm - t) * e", 343.0),
            ("'2nd'+1", 6.0),
            ("abs(-pwm)", 51.0),
            ("2*PI*t", 4.0 * std::f64::consts::PI),
        ];
        for (text, expected) in cases {
            let value = value(text, &cells).unwrap();
            assert!((value - expected).abs() < 1e-12, "{text}: {value}");
        }
    }

    #[test]
    fn what_is_no_column_is_named() {
        assert_eq!(value("pwn/255", &[]), Err(Unreadable::NoColumn("pwn".into())));
        assert_eq!(value("'rpm'*2", &[]), Err(Unreadable::NoColumn("rpm".into())));
        assert!(matches!(value("pwm/", &[]), Err(Unreadable::Broken(_))));
        assert!(matches!(value("{pwm", &[]), Err(Unreadable::Broken(_))));
    }
}
