//! Explanations that the rows cannot tell apart, and the experiment that can.

use super::case::{Case, Found};
use super::rivals::Replacement;
use super::separate::{self, Contrast};
use super::speed_unit::SpeedUnit;
use crate::outcome::*;
use crate::text::figures::figure;

impl Case<'_> {
    /// The ties, each with the contrast that separates its first rivals.
    pub(super) fn ties(&self, found: &Found, noise: f64, unit: SpeedUnit) -> Vec<(Tie, Option<Contrast>)> {
        let top = self.search.rows.top_v();
        let tie = |(k, tied): &(usize, Vec<Replacement>)| {
            let name = found.set.hypothesis.items[*k].effect.name.to_string();
            let contrasts: Vec<(String, Contrast)> = tied
                .iter()
                .filter_map(|r| {
                    let contrast = separate::best(&found.plant, &r.set.plant(), top, noise)?;
                    Some((r.names().join(" + "), contrast))
                })
                .collect();
            let rivals = std::iter::once(vec![name]).chain(tied.iter().map(Replacement::names)).collect();
            let separated_by = separation(&contrasts, noise, unit);
            (Tie { rivals, separated_by }, contrasts.into_iter().next().map(|c| c.1))
        };
        found.ties.iter().map(tie).collect()
    }
}

/// By what each rival is told from the accepted name, and how far apart they would be.
fn separation(contrasts: &[(String, Contrast)], noise: f64, unit: SpeedUnit) -> String {
    let one = |(rival, c): &(String, Contrast)| {
        let (protocol, speed, current) = (&c.protocol.name, unit.text(c.speed_rad_s), figure(c.current_a));
        match c.visible_in_speed(noise) {
            true => format!("from {rival} by the speed over time in {protocol} (up to {speed} apart)"),
            false if c.current_a > 1e-3 => {
                format!(
                    "from {rival} by the winding current in {protocol} (up to {current} A apart, while the speeds agree)"
                )
            }
            false => {
                format!("from {rival} by nothing that speed and current show: inspect the parts themselves")
            }
        }
    };
    contrasts.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// The experiment of the first tie that one can separate; another tie is often separated by the same run.
pub(super) fn next(ties: &[(Tie, Option<Contrast>)]) -> Option<Experiment> {
    let (tie, contrast) = ties.iter().find_map(|(t, c)| Some((t, c.as_ref()?)))?;
    let rivals = tie.rivals.iter().map(|r| r.join(" + ")).collect::<Vec<String>>().join(", ");
    let why = format!("It tells {rivals} apart. Log speed over time, and the winding current if you can.");
    Some(Experiment::new(why, contrast.protocol.profile.clone(), "V"))
}
