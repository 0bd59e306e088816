//! The bench image in QEMU: what it counted.

use crate::test_image;

/// One subject.
#[derive(Clone, Debug, PartialEq)]
pub struct Count {
    /// What was counted.
    pub name: String,
    /// Control rate, Hz; 0 where there is none.
    pub tick_hz: u32,
    /// Updates counted.
    pub updates: u32,
    /// Instructions per update, mean.
    pub average: f64,
    /// Most instructions of one update.
    pub worst: u32,
}

/// Builds the bench image and runs it.
pub fn run() -> Vec<Count> {
    let output = test_image::qemu(&test_image::built_as("bench-image", "bench-image", "bench-image"))
        .args(["-icount", "shift=4"])
        .output()
        .expect("QEMU can be started; try `cargo xtask setup`");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(parse).collect()
}

fn parse(line: &str) -> Count {
    let cells: Vec<&str> = line.trim().split(';').collect();
    let [name, tick_hz, updates, average, worst] = cells[..] else {
        panic!("the bench image says: {line}");
    };
    let number = |cell: &str| cell.parse::<u32>().unwrap_or_else(|_| panic!("the bench image says: {line}"));
    Count {
        name: name.into(),
        tick_hz: number(tick_hz),
        updates: number(updates),
        average: f64::from(number(average)) / 10.0,
        worst: number(worst),
    }
}
