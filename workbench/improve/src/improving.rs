//! The loop: record, name, compensate, try, keep or roll back; and again, as long as it brings something.
//!
//! Whatever ends it, one set is in force in the end, and read back: the last one that was kept, or the one of before.

use crate::bench::Bench;
use crate::candidate::{self, Analysed};
use crate::history::{self, Entry, Gap, Pending};
use crate::motions::ability;
use crate::record::Plan;
use crate::recording;
use crate::trial::{self, Tried};
use anyhow::Result;
use serde::Serialize;
use servo::identify::estimate::{Estimate, Estimates, Reason, Standing};
use servo::store::AxisParameters;
use std::path::{Path, PathBuf};
use truing_core::outcome::{Outcome, Verdict};
use truing_core::system::model::Model;
use truing_core::text::input_error::{InputError, NotDone};
use truing_report::console::interrupt;
use truing_servo::device::commission_report::CommissionJson;
use truing_servo::device::session::{Done, Start, Task};
use truing_servo::device::setup::Setup;

/// The loop goes round so often at most.
const ROUNDS: usize = 3;
/// Length of a commissioning, s: that of `truing commission`.
pub const COMMISSION_S: f64 = 5.0;
/// A motor that is too slow for it is given so many times as long: 15 s hold the ten time constants of a motor of 1.5 s.
const LONGER: f64 = 3.0;
/// So much of what a trial takes is kept for it while a recording is planned: the recording may find a slower motor, and a shaft
/// may come to rest more slowly than its time constant says. At 1, of 60 drawn motors 16 instead of 19 follow better after 60 s, and 51
/// instead of 52 after 180 s.
const SPARE: f64 = 1.15;
/// Further experiments of a round that parts the names of a tie.
const EXPERIMENTS: usize = 2;

const NO_NAME: &str =
    "what is left has no name in the library, and nothing is compensated that is not understood";
const NO_GAIN: &str = "no other numbers that were tried follow better than those in force";
const NOISE: &str = "model and motor differ by noise alone";
const FLOOR: &str = "the motor follows to a count of its encoder";
const SLOW: &str = "the motor comes to rest so slowly that a trial takes more motor time than is left";

/// What is to be improved, and with what.
pub struct Job {
    /// The axis file.
    pub setup: Setup,
    /// A model to begin from; `None`: what the servo knows of its motor.
    pub model: Option<Model>,
    /// Folder of logs, history and report.
    pub out: PathBuf,
    /// Time that the motor may take, s.
    pub budget_s: f64,
    /// Orders what is recorded.
    pub seed: u64,
    /// How a log is looked at: [`candidate::analysed`].
    pub analyse: Analyse,
}

/// Finds in all logs together what a model lacks.
pub type Analyse = Box<dyn Fn(&Model, &[PathBuf]) -> Result<Analysed>>;

/// Why the loop has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// Model and motor differ by noise alone, or the motor follows to a count.
    NoiseFloor,
    /// Nothing that was tried follows better, or there was nothing to try.
    NothingGained,
    /// What is left has no name in the library: nothing is compensated that is not understood.
    OutsideTheLibrary,
    /// Another step would take more time than is left.
    MotorTime,
    /// The loop went round as often as it may.
    Rounds,
    /// A fault, a refusal or the data ended it.
    Fault,
}

/// `truing-improve/1`.
#[derive(Debug, Serialize)]
pub struct Improved {
    /// `truing-improve/1`.
    pub schema: &'static str,
    /// Why it has ended.
    pub stop: Stop,
    /// The same in a sentence.
    pub why: String,
    /// How long the motor was under way, s.
    pub motor_s: f64,
    /// Was anything kept?
    pub improved: bool,
    /// What was tried.
    pub entries: Vec<Entry>,
    /// Old numbers of the first trial; `None`: there was none.
    pub began_with: Option<AxisParameters>,
    /// In force in the end; `None`: the axis is not configured, as before.
    pub in_force: Option<AxisParameters>,
    /// Answers of the gap workflow, one a round, for the report.
    #[serde(skip)]
    pub outcomes: Vec<Outcome>,
    /// The last extended model.
    #[serde(skip)]
    pub model: Option<Model>,
}

/// Is told what happens.
pub type Listener<'a> = dyn FnMut(&str) + 'a;

/// An end of the loop, with its sentence; it is passed on like an error.
#[derive(Debug, thiserror::Error)]
#[error("{1}")]
struct Ended(Stop, String);

fn ended<T>(stop: Stop, why: impl Into<String>) -> Result<T> {
    Err(Ended(stop, why.into()).into())
}

/// Runs the loop. In every case the servo is left as [`Improved::in_force`] says.
///
/// # Errors
/// The servo is lost, an interruption, files that cannot be written. The old set is in force again; if not, the error says
/// so.
pub fn run(bench: Bench, job: Job, say: &mut Listener) -> Result<Improved> {
    let _hold = interrupt::hold();
    recover(&bench, &job.out, say)?;
    let before = bench.in_force()?;
    if before.is_some_and(|before| !job.setup.agrees(&before.config)) {
        let what = "the axis file describes another axis than the one that is in force; correct it, or `truing params reset`";
        return Err(InputError(what.into()).into());
    }
    let mut improving = Improving {
        bench,
        job,
        standing: before,
        base: None,
        fresh: None,
        doubted: false,
        commission_s: COMMISSION_S,
        began_with: None,
        recordings: 0,
        entries: Vec::new(),
        outcomes: Vec::new(),
    };
    let ended = improving.rounds(say);
    improving.leave(ended)
}

/// Rolls back what a killed command may have left in force.
pub fn recover(bench: &Bench, out: &Path, say: &mut Listener) -> Result<()> {
    let Some(pending) = Pending::read(out)? else { return Ok(()) };
    let now = bench.moment()?;
    if bench.in_force()?.is_some_and(|acting| pending.lingers(&acting, &now)) {
        bench.put(pending.before.as_ref())?;
        say("an earlier command was killed: its candidate was in force, the old parameters are again");
    }
    bench.trial(0)?;
    Pending::end(out)
}

struct Improving {
    bench: Bench,
    job: Job,
    /// What is left in force whatever happens: that of before, or the last one that was kept.
    standing: Option<AxisParameters>,
    /// Old numbers of the trials: what stands, or the linear ones of a commissioning where the loops cannot be closed with it.
    base: Option<AxisParameters>,
    /// What a commissioning of this command has found, until it was tried.
    fresh: Option<AxisParameters>,
    /// The servo does not trust the gain that it has found.
    doubted: bool,
    /// How long a commissioning of this motor takes, s.
    commission_s: f64,
    began_with: Option<AxisParameters>,
    recordings: u64,
    entries: Vec<Entry>,
    outcomes: Vec<Outcome>,
}

impl Improving {
    fn left_s(&self) -> f64 {
        self.job.budget_s - self.bench.motor_s
    }

    /// Goes round until something ends it.
    fn rounds(&mut self, say: &mut Listener) -> Result<()> {
        let closes = self.standing.filter(|standing| ability(standing).is_some());
        self.base = closes;
        if closes.is_none_or(|standing| standing.estimates.gain.trusted().is_none()) {
            self.commission(say)?;
        }
        for _ in 0..ROUNDS {
            self.round(say)?;
        }
        ended(Stop::Rounds, format!("{ROUNDS} rounds were made"))
    }

    /// Numbers with which the loops can be closed and a first model exists. For the trial the servo takes gain and time constant
    /// even where it does not trust them: the motor will show what they are worth.
    fn commission(&mut self, say: &mut Listener) -> Result<()> {
        if self.left_s() < self.commission_s {
            return ended(Stop::MotorTime, "the motor time does not suffice for a commissioning");
        }
        say("commissioning: the servo does not know its motor yet");
        let config = self.standing.map_or(self.job.setup.config, |standing| standing.config);
        let nothing = AxisParameters { config, ..self.job.setup.parameters(self.standing.as_ref()) };
        let (mut fresh, refused) = self.commissioned(&nothing)?;
        let Estimates { gain, time_constant, .. } = &mut fresh.estimates;
        self.doubted = gain.trusted().is_none() || time_constant.trusted().is_none();
        (*gain, *time_constant) = (taken(*gain), taken(*time_constant));
        let estimates = Estimates { gain: *gain, time_constant: *time_constant, ..Estimates::default() };
        let linear = AxisParameters { estimates, compensation: false, ..fresh };
        match (refused, candidate::known(&linear).is_some_and(|known| known.gain_rad_s_per_v.value.is_some()))
        {
            (Some(why), false) => return ended(Stop::Fault, format!("the commissioning was refused: {why}")),
            (Some(why), true) => say(&format!("the servo trusts little of it: {why}")),
            (None, _) => {}
        }
        if ability(&linear).is_none() {
            return ended(Stop::Fault, "the commissioning has found no gain");
        }
        self.base = self.base.or(Some(linear));
        self.fresh = Some(fresh);
        Ok(())
    }

    /// A commissioning beside what is known of the load; what it has found, and why the servo refused it.
    fn commissioned(&mut self, beside: &AxisParameters) -> Result<(AxisParameters, Option<String>)> {
        self.pending(*beside)?;
        let setup = self.standing.map_or(self.job.setup, |_| beside.config.into());
        let tasks = [
            Task::Adopt(Box::new(beside.estimates)),
            Task::PositionLoad(beside.position_load),
            Task::Commission { budget_s: self.commission_s, seed: self.job.seed as u32 },
        ];
        let result = self.bench.session(Start::Configure(setup), &tasks)?.complete()?;
        self.bench.took(&result.log);
        result.log.save(&self.job.out.join("commissioning.csv"))?;
        let Some(Done::Commissioned(outcome)) = result.done.last() else {
            return ended(Stop::Fault, "the servo has not ended its commissioning");
        };
        let refused = CommissionJson::new(outcome, &result.log.config)?.beside(&result.log).refused;
        let short = [Reason::TooShort, Reason::NotExcited].map(Reason::code);
        let slow = refused.as_ref().is_some_and(|refused| short.contains(&refused.code));
        if slow && self.commission_s == COMMISSION_S && self.left_s() >= LONGER * COMMISSION_S {
            self.commission_s = LONGER * COMMISSION_S;
            return self.commissioned(beside);
        }
        let found = AxisParameters { config: result.log.config, estimates: outcome.estimates, ..*beside };
        Ok((found, refused.map(|refused| refused.text)))
    }

    /// One round; it ends the loop if another one would bring nothing more.
    fn round(&mut self, say: &mut Listener) -> Result<()> {
        let base = self.base.ok_or_else(|| InputError("there is nothing to begin from".into()))?;
        let known = self.fresh.unwrap_or(base);
        let Some(model) = self.job.model.clone().or_else(|| candidate::first_model(&known, !self.doubted))
        else {
            return ended(Stop::Fault, "the servo knows no gain of its motor; give --model");
        };
        let (logs, Analysed { outcome, extended }) = self.analysed(&model, &known, say)?;
        let entry = Entry {
            names: outcome.effects.iter().map(|effect| effect.name.clone()).collect(),
            gap: Some(Gap::of(&outcome)),
            logs,
            ..Entry::now(self.standing)
        };
        let verdict = outcome.verdict;
        self.outcomes.push(outcome);
        if verdict == Verdict::Data {
            return ended(Stop::Fault, "the log contradicts the model file; look at it with `truing gap`");
        }
        let (mut proposed, remarks) = candidate::candidate(&extended, &known, None)?;
        remarks.iter().for_each(|remark| say(remark));
        if self.is_hidden_by_load(&known, &proposed)? {
            say("commissioning: what depends on the place is held now");
            let (seen, _) = self.commissioned(&proposed)?;
            proposed = candidate::candidate(&extended, &known, Some(&seen.estimates))?.0;
        }
        self.job.model = Some(extended);
        self.fresh = None;
        let Estimates { gain, time_constant, .. } = known.estimates;
        // What the servo cannot compensate is, within its own gain and time constant, in the mean of all that it does.
        let estimates = Estimates { gain, time_constant, ..proposed.estimates };
        let mixed = AxisParameters { estimates, ..proposed };
        match (self.propose([proposed, mixed, known], entry, say)?, verdict) {
            (_, Verdict::Unexplained) => ended(Stop::OutsideTheLibrary, NO_NAME),
            (true, Verdict::NothingMissing) => ended(Stop::NoiseFloor, NOISE),
            (true, _) => Ok(()),
            (false, _) => ended(Stop::NothingGained, NO_GAIN),
        }
    }

    /// Has the servo trusted no dead zone because of a load that this candidate holds, and does another look at it fit?
    fn is_hidden_by_load(&self, known: &AxisParameters, candidate: &AxisParameters) -> Result<bool> {
        let hidden = known.estimates.dead_zone.iter().all(|side| side.trusted().is_none());
        let holds = candidate.position_load.period_counts() != 0;
        Ok(hidden && holds && self.left_s() >= self.commission_s + trial::seconds([known, candidate])?)
    }

    /// Records and looks for names; as long as a tie is left, the experiment that parts its names.
    fn analysed(
        &mut self,
        model: &Model,
        known: &AxisParameters,
        say: &mut Listener,
    ) -> Result<(Vec<PathBuf>, Analysed)> {
        let spare = SPARE * trial::seconds([known; 2]).unwrap_or(0.0);
        self.recordings += 1;
        let seed = self.job.seed + self.recordings;
        let Some(plan) = recording::plan(known, self.left_s() - spare, seed)? else {
            return ended(Stop::MotorTime, "a recording takes more motor time than is left");
        };
        let mut logs = vec![self.recorded(known, &plan, say)?];
        let mut seen = (self.job.analyse)(model, &logs)?;
        for _ in 0..EXPERIMENTS {
            let asked = seen.outcome.next_experiment.as_ref().filter(|_| !seen.outcome.ties.is_empty());
            let next = asked.and_then(|asked| recording::experiment(&plan, asked));
            let Some(next) = next.filter(|next| next.seconds <= self.left_s() - spare) else { break };
            say("the log has two explanations: an experiment that tells them apart");
            logs.push(self.recorded(known, &next, say)?);
            seen = (self.job.analyse)(model, &logs)?;
        }
        Ok((logs, seen))
    }

    fn recorded(&mut self, known: &AxisParameters, plan: &Plan, say: &mut Listener) -> Result<PathBuf> {
        self.pending(*known)?;
        say(&format!("recording: {:.1} s", plan.seconds));
        let stamp = jiff::Timestamp::now().strftime("%Y%m%d-%H%M%S-%3f");
        let path = self.job.out.join(format!("run-{stamp}.csv"));
        recording::record(&mut self.bench, known, plan, &path)?;
        // A search for names is silent for longer than a trial may be.
        self.put_back()?;
        say("looking for what the model lacks");
        Ok(path)
    }

    /// Tries candidates in turn until one is kept.
    fn propose(&mut self, all: [AxisParameters; 3], entry: Entry, say: &mut Listener) -> Result<bool> {
        let Some(base) = self.base else { return Ok(false) };
        let mut others = vec![base];
        for candidate in all {
            if !others.iter().all(|other| candidate::differs(&candidate, other)) {
                continue;
            }
            others.push(candidate);
            if self.try_out(&candidate, &base, entry.clone(), say)? {
                return Ok(true);
            }
        }
        if others.len() == 1 {
            let why = "nothing else than what is in force is known of the motor".into();
            self.note(Entry { why, ..entry }, say)?;
        }
        Ok(false)
    }

    /// The paired trial of one candidate: kept and stored, or rolled back.
    fn try_out(
        &mut self,
        candidate: &AxisParameters,
        base: &AxisParameters,
        entry: Entry,
        say: &mut Listener,
    ) -> Result<bool> {
        if trial::seconds([base, candidate])? > self.left_s() {
            return ended(Stop::MotorTime, "a trial takes more motor time than is left");
        }
        say(&format!("trying: {} pairs of runs, old and new numbers in turns", trial::PAIRS));
        self.pending(*candidate)?;
        self.began_with.get_or_insert(*base);
        let tried = trial::run(&mut self.bench, [base, candidate], self.job.budget_s)?;
        let understood = self.outcomes.last().is_none_or(|it| it.verdict != Verdict::Unexplained);
        let won = matches!(&tried, Tried::Whole(trial) if trial.won(understood));
        let store = || self.bench.put(Some(candidate)).and_then(|()| self.bench.keep(Some(candidate)));
        let stored = if won { store() } else { Ok(()) };
        let kept = won && stored.is_ok();
        if kept {
            (self.standing, self.base) = (Some(*candidate), Some(*candidate));
        }
        self.put_back()?;
        let (why, ends) = match (&tried, stored) {
            (_, Err(InputError(what))) => (format!("better, but not stored: {what}"), Some(Stop::Fault)),
            (Tried::Whole(_), _) if won => ("it follows better".into(), None),
            (Tried::Whole(trial), _) if trial.at_floor() => (FLOOR.into(), Some(Stop::NoiseFloor)),
            (Tried::Whole(_), _) => ("it does not follow better beyond doubt".into(), None),
            (Tried::OutOfTime, _) => (SLOW.into(), Some(Stop::MotorTime)),
            (Tried::Faulted(new, what), _) => {
                let (which, stop) = if *new { ("new", None) } else { ("old", Some(Stop::Fault)) };
                (format!("a fault ended a run with the {which} numbers: {what}"), stop)
            }
        };
        let trial = if let Tried::Whole(trial) = tried { Some(trial) } else { None };
        self.note(Entry { kept, why: why.clone(), trial, ..entry.with(candidate) }, say)?;
        ends.map_or(Ok(kept), |stop| ended(stop, why))
    }

    /// Notes what is to be put back if this program does not live to do so.
    fn pending(&self, candidate: AxisParameters) -> Result<()> {
        Pending { before: self.standing, candidate, at: self.bench.moment()? }.begin(&self.job.out)?;
        Ok(self.bench.trial(candidate.config.tick_hz)?)
    }

    /// What stands is in force, and nothing is on trial.
    fn put_back(&self) -> Result<(), InputError> {
        self.bench.put(self.standing.as_ref())?;
        self.bench.trial(0)
    }

    fn note(&mut self, entry: Entry, say: &mut Listener) -> Result<()> {
        let entry = Entry { at: self.bench.moment().ok(), ..entry };
        say(entry.text().trim_end());
        history::append(&self.job.out, &entry)?;
        self.entries.push(entry);
        Ok(())
    }

    /// Leaves the servo with what stands, whatever has happened.
    fn leave(self, ended: Result<()>) -> Result<Improved> {
        let cause = ended.err().unwrap_or_else(|| InputError("the loop has no end".into()).into());
        if let Err(error) = self.put_back() {
            let remedy = "switch its supply off and on: what it has stored comes into force again";
            let what = "what was in force before could not be put back";
            return Err(NotDone(format!("{cause:#}; {what} ({error}): {remedy}")).into());
        }
        Pending::end(&self.job.out)?;
        let Ended(stop, why) = match cause.downcast::<NotDone>() {
            Ok(NotDone(why)) => Ended(Stop::Fault, why),
            Err(other) => {
                other.downcast().map_err(|error| error.context("what was stored is in force again"))?
            }
        };
        Ok(Improved {
            schema: "truing-improve/1",
            stop,
            why,
            motor_s: self.bench.motor_s,
            improved: self.entries.iter().any(|entry| entry.kept),
            entries: self.entries,
            began_with: self.began_with,
            in_force: self.standing,
            outcomes: self.outcomes,
            model: self.job.model,
        })
    }
}

/// A number that is used although the servo would not.
fn taken(estimate: Estimate) -> Estimate {
    let standing = estimate.known().map_or(estimate.standing, |_| Standing::Trusted);
    Estimate { standing, ..estimate }
}
