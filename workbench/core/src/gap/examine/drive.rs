//! A drive that acts one way, or that rectifies.

use super::motion::{Base, Motion};
use super::suspects::Suspect;
use crate::system::log::Dynamic;

/// So much of the motion such a drive must explain: a sensor without a sign explains less, for it goes through 0 at
/// each reversal. Chosen by judgement, tried with the others of `examine`.
const MOST: f64 = 0.98;

type Drive = (Makes, &'static str, &'static str);

/// What a drive may make of a command, in words and as an expression over it.
const DRIVES: [Drive; 4] = [
    (|u| u.max(0.0), "the drive acts in one direction only: below 0 it does nothing", "({}+abs({}))/2"),
    (|u| u.min(0.0), "the drive acts in one direction only: above 0 it does nothing", "({}-abs({}))/2"),
    (f64::abs, "the drive rectifies: it drives one way whatever the sign of its command", "abs({})"),
    (|u| -u.abs(), "the drive rectifies: it drives one way whatever the sign of its command", "-abs({})"),
];

/// What a drive makes of a command.
pub type Makes = fn(f64) -> f64;

/// The drive that explains most, if one explains the motion, and what it makes of a command.
pub fn fault(motion: &Motion, record: &Dynamic, base: &Base, fitted: bool) -> Option<(f64, Suspect, Makes)> {
    if !motion.is_driven_both_ways() {
        return None;
    }
    let explained = |drive: &Drive| motion.driven_by(drive.0).explained_within(base, fitted);
    let may = |drive: &&Drive| motion.turns_one_way((drive.0(1.0) + drive.0(-1.0)).signum());
    let drives = DRIVES.iter().filter(may).map(|drive| (explained(drive), drive));
    let (explained, (makes, what, expression)) = drives.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let column = record.input.column();
    let remedy = record.names.mended(&[(column, &|theirs| expression.replace("{}", &theirs.text))]);
    (explained > MOST).then(|| (explained, Suspect::new(column, *what, remedy, 1.0, 1.0), *makes))
}
