//! The list of what a fleet measured: unit, time, model and log, a row each.

use crate::moment::Moment;
use crate::store::unit_name;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use truing_core::text::input_error::InputError;
use truing_report::console::files::folder_of;

/// One log: one task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// The motor's name.
    pub unit: String,
    /// When the log was taken.
    pub at: Moment,
    /// The model file from which a search starts.
    pub model: PathBuf,
    /// The log.
    pub log: PathBuf,
}

/// A row as it stands in the file.
#[derive(Deserialize)]
struct Row {
    unit: String,
    time: String,
    model: PathBuf,
    log: PathBuf,
}

/// The tasks of each unit in the order of time. Relative paths start at the manifest's folder.
///
/// An error names the line: a cell that is missing, a time that is none, a name that cannot be a folder's, or two logs of one unit at
/// one time.
pub fn read(path: &Path) -> Result<Vec<Vec<Task>>, InputError> {
    let unreadable = |error: csv::Error| InputError::file(path.display(), broken(&error));
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(unreadable)?;
    let (mut units, mut seen) = (BTreeMap::<String, Vec<Task>>::new(), BTreeSet::new());
    for (k, row) in reader.deserialize::<Row>().enumerate() {
        let refused = |what: String| InputError::line(path.display(), k as u64 + 2, what);
        let row = row.map_err(unreadable)?;
        let at: Moment = row.time.parse().map_err(refused)?;
        let unit = unit_name(&row.unit).map_err(refused)?.to_owned();
        if !seen.insert((unit.clone(), at)) {
            return Err(refused(format!("unit {unit} has two logs at {at}; give each its own time")));
        }
        let beside = |file: PathBuf| folder_of(path).join(file);
        let task = Task { unit: unit.clone(), at, model: beside(row.model), log: beside(row.log) };
        units.entry(unit).or_default().push(task);
    }
    let mut units: Vec<Vec<Task>> = units.into_values().collect();
    units.iter_mut().for_each(|tasks| tasks.sort_by_key(|task| task.at));
    if units.is_empty() {
        return Err(InputError::file(
            path.display(),
            "holds no row; write unit,time,model,log and a row a log",
        ));
    }
    Ok(units)
}

fn broken(error: &csv::Error) -> String {
    format!("is no manifest ({error}); its columns are unit,time,model,log")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(rows: &str) -> Result<Vec<Vec<Task>>, InputError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("manifest.csv");
        std::fs::write(&path, format!("unit,time,model,log\n{rows}")).unwrap();
        read(&path)
    }

    #[test]
    fn tasks_of_a_unit_stand_in_the_order_of_time_whatever_the_rows_say() {
        let rows = "b,2026-03-02,m.toml,2.csv\na,2026-03-01,m.toml,3.csv\nb,2026-03-01,m.toml,1.csv\n";
        let units = manifest(rows).unwrap();
        let names: Vec<&str> = units.iter().map(|tasks| tasks[0].unit.as_str()).collect();
        assert_eq!(names, ["a", "b"]);
        assert!(units[1][0].log.ends_with("1.csv") && units[1][1].log.ends_with("2.csv"));
    }

    #[test]
    fn what_is_wrong_in_a_row_is_told_with_its_line() {
        let told = |rows: &str| manifest(rows).unwrap_err().to_string();
        assert!(told("a,soon,m,l\n").contains("line 2: `soon` is no time"));
        assert!(told("a,2026-03-01,m,l\n../b,2026-03-01,m,l\n").contains("line 3: `../b` is no name"));
        let twice = "a,2026-03-01,m,l\na,2026-03-01T00:00:00Z,m,k\n";
        assert!(told(twice).contains("line 3: unit a has two logs at 2026-03-01T00:00:00Z"));
        assert!(told("").contains("holds no row"));
        assert!(told("a,2026-03-01,m\n").contains("unit,time,model,log"));
    }
}
