//! What a file's columns probably are where their names do not say it: the `--columns` that would work, with what was
//! guessed and from which range of values.

use super::cells::Cells;
use super::column_plan::{INPUTS, OUTPUTS, Plan, Proposal};
use super::extent::{Extent, is_too_fast};
use super::folded;
use super::meaning::{Meaning, Sure, words};
use super::names::{Quantity, name_of, quantity_of};
use super::spelling::short;
use super::words::{Measure, Topic};

/// Full scales of a PWM: per cent, 8 bits, drivers that count to 400, thousandths, 10 to 16 bits. Chosen by
/// judgement, from what drivers and timers count to.
const FULL_SCALES: [f64; 10] = [1.0, 100.0, 255.0, 400.0, 1000.0, 1023.0, 4095.0, 8191.0, 32767.0, 65535.0];
/// A supply that is proposed when none is known, V. Chosen by judgement; not studied.
const USUAL_SUPPLY_V: f64 = 12.0;
/// A counter that wraps at this or later is no turn of an encoder. Chosen by judgement; not studied.
const MOST_COUNTS: f64 = 65_536.0;
/// Counts per turn that are proposed when none are known. Chosen by judgement; not studied.
const USUAL_COUNTS: f64 = 4096.0;
/// Above this a voltage without a unit is in millivolts: no servo of this project has so many volts. Chosen by
/// judgement; not studied.
const MOST_VOLTS: f64 = 200.0;
/// Speeds beyond this are more likely rpm than rad/s: 2,900 rpm. Chosen by judgement; not studied.
const RATHER_RPM: f64 = 300.0;
/// Whole numbers that advance by so many a row count microseconds. Origin: 2 kHz in µs, or 2 Hz in ms.
const MICROSECONDS: f64 = 500.0;
/// Whole numbers that advance by so many a row count nanoseconds. Origin: 2 kHz in ns, or 2 Hz in µs.
const NANOSECONDS: f64 = 500e3;
/// Pole pairs that are proposed when none are known. Chosen by judgement; not studied.
const USUAL_POLE_PAIRS: f64 = 7.0;
/// Pulse widths of a radio-control servo, µs: the middle, and the way to either end. Origin: the convention of such
/// servos, 1 to 2 ms.
const PULSE_US: [f64; 2] = [1500.0, 500.0];

/// The least full scale of a PWM that such numbers fit into.
pub fn full_scale(most: f64) -> f64 {
    FULL_SCALES.into_iter().find(|full| most <= *full).unwrap_or(most)
}

/// A file's name as an item of `--columns` holds it.
fn spelled(name: &str) -> String {
    match name.contains([',', '"', '\'']) {
        true if name.contains('\'') => format!("\"{name}\""),
        true => format!("'{name}'"),
        false => name.to_owned(),
    }
}

/// What is known besides the file.
pub struct Known {
    /// Nominal supply, V.
    pub supply_v: Option<f64>,
    /// Counts of the encoder per turn.
    pub counts_per_rev: Option<f64>,
    /// The user has spoken of the time.
    pub time: bool,
}

/// Adds what is lacking to a plan: proposals, or a sentence that says what is missing.
pub fn complete(known: &Known, cells: &Cells, plan: &mut Plan, output_needed: bool) {
    let desk = Desk { known, cells, plan: &*plan };
    let untimed = !plan.has(Quantity::Time) && !known.time;
    let mut proposals: Vec<Proposal> = untimed.then(|| desk.time()).flatten().into_iter().collect();
    let timed = plan.has(Quantity::Time) || !proposals.is_empty();
    let mut missing = if untimed && !timed { desk.no_time() } else { None };
    let input = if plan.any(&INPUTS) { Some(desk.supply()) } else { desk.input() };
    let lacks = || desk.missing(INPUT, &["u", "v", "duty", "torque", "force", "current"]);
    missing = missing.or_else(|| input.is_none().then(lacks));
    proposals.extend(input.unwrap_or_default());
    let needed = if timed { &OUTPUTS[..] } else { &[Quantity::AngularSpeed] };
    if output_needed && !plan.any(needed) {
        let of_plan = plan.origins.iter().filter(|origin| INPUTS.contains(&origin.quantity));
        let driven = of_plan.flat_map(|origin| origin.formula.indices()).copied().next();
        let proposed = proposals.iter().skip(usize::from(!plan.has(Quantity::Time) && timed));
        match desk.output(timed, driven.or(proposed.filter_map(|proposal| proposal.column).next())) {
            Some(proposal) => proposals.push(proposal),
            None => missing = missing.or(Some(desk.missing_output(timed))),
        }
    }
    (plan.proposals, plan.missing) = (proposals, missing);
}

const INPUT: &str = "for the input (u_v, duty with vbus_v, current_a, torque_nm or force_n)";

/// What proposals are made from.
struct Desk<'a> {
    known: &'a Known,
    cells: &'a Cells,
    plan: &'a Plan,
}

impl Desk<'_> {
    /// Columns that speak of a topic and are not used, likelier ones first.
    fn about(&self, topic: Topic) -> Vec<(usize, Meaning, Extent)> {
        let used: Vec<usize> =
            self.plan.origins.iter().flat_map(|origin| origin.formula.indices().to_vec()).collect();
        let all = self.plan.meanings.iter().enumerate();
        let of_it = all.filter_map(|(index, meaning)| {
            let meaning = meaning.filter(|meaning| meaning.topic == topic && !meaning.strange())?;
            let extent = Extent::of(self.cells.values(index))?;
            // What never changes drives nothing and shows nothing; a supply may.
            let changes = extent.min < extent.max || topic == Topic::Supply || self.cells.rows < 2;
            // Nor does what counts the rows show any motion.
            let counts = extent.step == 1.0 && extent.max - extent.min == self.cells.rows as f64 - 1.0;
            let tells = changes && !(counts && [Topic::Speed, Topic::Position].contains(&topic));
            Some((index, meaning, extent)).filter(|_| tells && !used.contains(&index))
        });
        let mut found: Vec<_> = of_it.collect();
        found.sort_by_key(|known| (known.1.sure == Sure::Likely, known.1.unit.is_none()));
        found
    }

    /// The same, what belongs to the motor of the input first: `left_rpm` beside `left_pwm`.
    fn beside(&self, topic: Topic, input: Option<usize>) -> Vec<(usize, Meaning, Extent)> {
        let words = |index: usize| words(self.name(index));
        let other = input.map(words).unwrap_or_default();
        let mut found = self.about(topic);
        found.sort_by_key(|known| {
            std::cmp::Reverse(words(known.0).iter().filter(|word| other.contains(word)).count())
        });
        found
    }

    fn name(&self, index: usize) -> &str {
        &self.cells.header[index]
    }

    fn proposal(&self, ours: &str, index: usize, formula: &str, why: String) -> Proposal {
        let item = format!("{ours}={}{formula}", spelled(self.name(index)));
        Proposal { item, why, column: Some(index) }
    }

    /// `name` with its range, and other columns of the same kind.
    fn seen(&self, found: &[(usize, Meaning, Extent)]) -> String {
        let (index, _, extent) = found[0];
        let others: Vec<String> = found[1..].iter().map(|it| format!("`{}`", self.name(it.0))).collect();
        let beside = format!(", one of several beside {},", others.join(", "));
        let others = if others.is_empty() { "" } else { &beside };
        format!("`{}` ({} … {}){others}", self.name(index), short(extent.min), short(extent.max))
    }

    fn time(&self) -> Option<Proposal> {
        if let Some(both) = self.seconds_and_nanoseconds() {
            return Some(both);
        }
        let found = self.about(Topic::Time);
        let (index, meaning, extent) = *found.first()?;
        let ours = match (meaning.unit, extent.whole) {
            (Some((Measure::Time, factor)), _) if !is_too_fast(self.cells, index, factor) => {
                name_of(Quantity::Time, factor)
            }
            (_, true) if extent.step >= NANOSECONDS => "t_ns",
            (_, true) if extent.step >= MICROSECONDS => "t_us",
            (_, true) => "t_ms",
            (_, false) => "t_s",
        };
        let (seen, step, unit) = (self.seen(&found), short(extent.step), ours.trim_start_matches("t_"));
        let why = format!("{seen} is the time, and its rows are mostly {step} apart, as if in {unit}");
        Some(self.proposal(ours, index, "", why))
    }

    /// A time whose cells are not understood.
    fn no_time(&self) -> Option<String> {
        let is_time =
            |index: &usize| self.plan.meanings[*index].is_some_and(|meaning| meaning.topic == Topic::Time);
        let (index, cell) = (0..self.cells.header.len())
            .filter(is_time)
            .find_map(|index| Some((index, &self.cells.columns[index].refused.as_ref()?.1)))?;
        Some(format!(
            "column {} seems to be the time, and `{cell}` is not understood; write seconds, map t_s=row*SECONDS, or t_s=none for a \
             table of settled speeds",
            self.name(index)
        ))
    }

    /// A stamp in two columns, as ROS has it.
    fn seconds_and_nanoseconds(&self) -> Option<Proposal> {
        let header = &self.cells.header;
        let (fine, index) = header.iter().find_map(|name| {
            let coarse = name.replace("nanosec", "sec").replace("nsec", "sec");
            Some((name, header.iter().position(|other| *other == coarse && other != name)?))
        })?;
        let (coarse, first) =
            (&header[index], self.cells.values(index).iter().find(|value| value.is_finite())?);
        let item = format!("t_s=('{coarse}'-{first})+'{fine}'/1000000000");
        let why = format!("`{coarse}` and `{fine}` are seconds and nanoseconds of one time");
        Some(Proposal { item, why, column: Some(index) })
    }

    fn input(&self) -> Option<Vec<Proposal>> {
        let duty = self.about(Topic::Duty);
        if let Some((index, meaning, extent)) = duty.first() {
            let why = |full: &str| format!("{} is a duty or PWM, {full}", self.seen(&duty));
            let duty = match meaning.unit {
                Some((Measure::Percent, _)) => self.proposal("duty_percent", *index, "", why("in per cent")),
                _ => self.duty(*index, extent, why),
            };
            return Some([vec![duty], self.supply_for_duty()].concat());
        }
        let voltage = self.about(Topic::Voltage);
        if let Some((index, meaning, extent)) = voltage.first() {
            let factor = meaning.quantity.map(|known| known.1);
            let guessed = if extent.most() > MOST_VOLTS { 1e-3 } else { 1.0 };
            let ours = name_of(Quantity::Voltage, factor.unwrap_or(guessed));
            let unit = if ours == "u_mv" { "mV" } else { "V" };
            let stated = if factor.is_some() { "" } else { "guessed " };
            let why = format!("{} is the voltage, {stated}in {unit}", self.seen(&voltage));
            return Some(vec![self.proposal(ours, *index, "", why)]);
        }
        let held = [
            (Topic::Torque, Quantity::Torque, "a torque"),
            (Topic::Force, Quantity::Force, "a force"),
            (Topic::Current, Quantity::CurrentInput, "a current, which drives the axis if a loop holds it,"),
        ];
        held.into_iter().find_map(|(topic, quantity, what)| {
            let found = self.about(topic);
            let (index, meaning, _) = found.first()?;
            let factor = meaning.quantity.map_or(1.0, |known| known.1);
            let ours = name_of(quantity, factor);
            let stated = if meaning.quantity.is_some() { "" } else { " guessed" };
            let why = format!("{} is {what}{stated} as {ours}", self.seen(&found));
            Some(vec![self.proposal(ours, *index, "", why)])
        })
    }

    fn duty(&self, index: usize, extent: &Extent, why: impl Fn(&str) -> String) -> Proposal {
        let [middle, way] = PULSE_US;
        if extent.min >= middle - 1.2 * way && extent.max <= middle + 1.2 * way {
            let item = format!("duty=({}-{middle})/{way}", spelled(self.name(index)));
            let why = why("guessed as pulses of 1,000 … 2,000 µs");
            return Proposal { item, why, column: Some(index) };
        }
        let full = full_scale(extent.most());
        if full == 1.0 {
            return self.proposal("duty", index, "", why("of full scale 1"));
        }
        let why = why(&format!("its full scale guessed as {full}"));
        self.proposal("duty", index, &format!("/{full}"), why)
    }

    /// The supply that a duty needs and that nothing states.
    fn supply_for_duty(&self) -> Vec<Proposal> {
        if self.plan.has(Quantity::Supply) || self.known.supply_v.is_some() {
            return Vec::new();
        }
        let supply = [self.about(Topic::Supply), self.about(Topic::Voltage)].concat();
        if let Some((index, meaning, extent)) = supply.first().filter(|known| known.2.min >= 0.0) {
            let guessed = if extent.most() > MOST_VOLTS { 1e-3 } else { 1.0 };
            let ours = name_of(Quantity::Supply, meaning.unit.map_or(guessed, |unit| unit.1));
            return vec![self.proposal(ours, *index, "", format!("{} is the supply", self.seen(&supply)))];
        }
        let why = format!(
            "no column vbus_v is there, which `duty` needs: put your supply in place of {USUAL_SUPPLY_V}, or [supply] nominal_v \
             into the model"
        );
        vec![Proposal { item: format!("vbus_v={USUAL_SUPPLY_V}"), why, column: None }]
    }

    /// For an input that is there: a duty alone needs a supply.
    fn supply(&self) -> Vec<Proposal> {
        let duty_alone = self.plan.has(Quantity::Duty) && !self.plan.has(Quantity::Voltage);
        if duty_alone { self.supply_for_duty() } else { Vec::new() }
    }

    fn output(&self, timed: bool, input: Option<usize>) -> Option<Proposal> {
        self.speed(input).or_else(|| self.position(timed, input))
    }

    fn speed(&self, input: Option<usize>) -> Option<Proposal> {
        let speed = self.beside(Topic::Speed, input);
        let (index, meaning, extent) = speed.first()?;
        Some(match (meaning.quantity, meaning.unit) {
            (Some((quantity, factor)), _) => {
                let ours = name_of(quantity, factor);
                let why = format!("{} is taken as the speed {ours}", self.seen(&speed));
                self.proposal(ours, *index, "", why)
            }
            (None, Some((Measure::Counts, _))) if self.name(*index).to_lowercase().contains("erpm") => {
                let seen = self.seen(&speed);
                let why = format!(
                    "{seen} is an electrical speed (put the pole pairs of the motor in place of {USUAL_POLE_PAIRS})"
                );
                self.proposal("omega_rpm", *index, &format!("/{USUAL_POLE_PAIRS}"), why)
            }
            (None, Some((Measure::Counts, _))) => {
                self.counts("omega_rev_s", *index, &self.seen(&speed), " a second")
            }
            _ => {
                let rpm = extent.most() > RATHER_RPM;
                let (ours, other) =
                    if rpm { ("omega_rpm", "omega_rad_s") } else { ("omega_rad_s", "omega_rpm") };
                let (seen, name) = (self.seen(&speed), spelled(self.name(*index)));
                let why = format!(
                    "{seen} is a speed without a unit, guessed as {ours} (else write {other}={name})"
                );
                self.proposal(ours, *index, "", why)
            }
        })
    }

    fn position(&self, timed: bool, input: Option<usize>) -> Option<Proposal> {
        let position = self.beside(Topic::Position, input);
        let (index, meaning, extent) = position.first().filter(|_| timed)?;
        if let Some((quantity, factor)) = meaning.quantity {
            let ours = name_of(quantity, factor);
            let why = format!("{} is taken as the position {ours}", self.seen(&position));
            return Some(self.proposal(ours, *index, "", why));
        }
        let values = self.cells.values(*index);
        let turns = [(360.0, "theta_deg"), (1.0, "theta_rev")];
        if let Some((full, ours)) =
            turns.into_iter().find(|unit| folded::full(values, Some(unit.0)) == Some(unit.0))
        {
            let why = format!("{} begins anew at {}, as a turn does", self.seen(&position), short(full));
            return Some(self.proposal(ours, *index, "", why));
        }
        if extent.whole || meaning.unit.is_some_and(|unit| unit.0 == Measure::Counts) {
            return Some(self.counts("theta_rev", *index, &self.seen(&position), ""));
        }
        let seen = self.seen(&position);
        let why = format!(
            "{seen} is a position without a unit, guessed as theta_rad (else write theta_deg or q_mm)"
        );
        Some(self.proposal("theta_rad", *index, "", why))
    }

    /// A position or speed in counts of the encoder.
    fn counts(&self, ours: &str, index: usize, seen: &str, per: &str) -> Proposal {
        let folded =
            folded::full(self.cells.values(index), None).filter(|full| *full < MOST_COUNTS && per.is_empty());
        let (counts, said) = match (self.known.counts_per_rev, folded) {
            (Some(counts), _) => (counts, "the model's [encoder] counts_per_rev".to_owned()),
            (None, Some(full)) => {
                (full, format!("it begins anew at {}, which is taken for a turn", short(full)))
            }
            (None, None) => (
                USUAL_COUNTS,
                format!("put the counts of a turn, after x4 decoding, in place of {USUAL_COUNTS}"),
            ),
        };
        self.proposal(ours, index, &format!("/{counts}"), format!("{seen} counts an encoder{per} ({said})"))
    }

    fn missing_output(&self, timed: bool) -> String {
        match timed {
            true => self.missing(
                "for the speed or the position (omega_rad_s, theta_rad, v_m_s or q_m)",
                &["theta", "q", "omega", "w", "v", "speed"],
            ),
            false => self.missing(
                "omega_rad_s or speed_rpm (and no t_s: a steady-state table)",
                &["omega", "speed", "w"],
            ),
        }
    }

    /// What to say when nothing can be proposed: the likeliest mistyped column, if there is one.
    fn missing(&self, wanted: &str, stems: &[&str]) -> String {
        let used = |index: usize| self.plan.origins.iter().any(|it| it.formula.indices().contains(&index));
        let near = self.cells.header.iter().enumerate().find(|(index, name)| {
            let begins = stems.iter().any(|stem| name.to_lowercase().starts_with(stem));
            begins && quantity_of(name).is_none() && !used(*index)
        });
        let listed = self.cells.header.join(", ");
        if self.cells.dialect.as_ref().is_some_and(|dialect| dialect.headless) {
            return format!(
                "the file has no header line, so no column {wanted}: say what its columns ({listed}) hold, for example with \
                 --columns \"t_ms=c1,u_v=c2,omega_rad_s=c3\", or put such names above them"
            );
        }
        match near {
            Some((_, name)) => format!(
                "no column {wanted}: `{name}` has an unknown unit or spelling; rename it or use --columns (header: {listed})"
            ),
            None => format!(
                "no column {wanted}; rename one or use --columns, which `truing look` helps with (header: {listed})"
            ),
        }
    }
}

impl Meaning {
    /// A unit is written that is not known, or that the quantity cannot have.
    fn strange(&self) -> bool {
        let fits = matches!(self.unit, None | Some((Measure::Counts | Measure::Percent, _)));
        self.strange_unit || self.quantity.is_none() && !fits
    }
}
