//! One instance of an FMU, without any C: what it was told, how far it is, and its plant.

use crate::description::token;
use crate::run::Run;
use crate::variables::{self, Role, Variable};
use percent_encoding::percent_decode_str;
use std::path::{Path, PathBuf};
use truing_core::system::model::{self, Model};

/// Times of importer and instance that differ by less than this, s for each second of the run, are the same. By judgement:
/// rounding is a thousand times less.
const SAME_TIME: f64 = 1e-9;

/// How far an instance is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Numbers of the model may be set.
    Before,
    /// It is stepped.
    Runs,
    /// It has ended, or a call has broken it.
    Over,
}

/// What a call has to say when it cannot be done.
pub type Said<T = ()> = Result<T, String>;

/// An instance.
pub struct Instance {
    model: Model,
    variables: Vec<Variable>,
    /// What an importer may keep and bring back.
    pub now: Snapshot,
}

/// All that changes: what `GetFMUState` keeps.
#[derive(Clone)]
pub struct Snapshot {
    values: Vec<f64>,
    run: Option<Run>,
    phase: Phase,
    start_s: f64,
}

impl Snapshot {
    fn before(variables: &[Variable]) -> Self {
        let values = variables.iter().map(|variable| variable.start).collect();
        Self { values, run: None, phase: Phase::Before, start_s: 0.0 }
    }
}

impl Instance {
    /// From the folder of the resources. `wanted`: the token of `modelDescription.xml`.
    pub fn open(resources: &Path, wanted: &str) -> Said<Self> {
        let path = resources.join("model.toml");
        let text = std::fs::read_to_string(&path)
            .map_err(|error| format!("{}: cannot be read ({error}); export the FMU again", path.display()))?;
        let model = model::parse("resources/model.toml", &text).map_err(|error| error.0)?;
        if token(&text) != wanted {
            return Err(
                "modelDescription.xml belongs to another model or version; export the FMU again".into()
            );
        }
        Self::of(model)
    }

    /// Of a model.
    pub fn of(model: Model) -> Said<Self> {
        let variables = variables::of(&model).map_err(|error| error.0)?;
        let now = Snapshot::before(&variables);
        Ok(Self { model, variables, now })
    }

    /// Its variables; a place is a value reference.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Where the experiment begins, s.
    pub fn begin_at(&mut self, start_s: f64) -> Said {
        if !start_s.is_finite() || self.now.phase != Phase::Before {
            return Err("the start time must be a finite number, set before the initialization ends".into());
        }
        self.now.start_s = start_s;
        Ok(())
    }

    /// Ends the initialization.
    pub fn initialized(&mut self) -> Said {
        if self.now.phase != Phase::Before {
            return Err("it is initialized already; reset it first".into());
        }
        self.run()?;
        self.now.phase = Phase::Runs;
        Ok(())
    }

    /// Ends the run.
    pub fn terminate(&mut self) -> Said {
        self.now.phase = Phase::Over;
        Ok(())
    }

    /// As it was when it was made.
    pub fn reset(&mut self) -> Said {
        self.now = Snapshot::before(&self.variables);
        Ok(())
    }

    /// Sets variables.
    pub fn set(&mut self, references: &[u32], values: &[f64]) -> Said {
        same_length(references, values)?;
        references.iter().zip(values).try_for_each(|(reference, value)| self.set_one(*reference, *value))
    }

    fn set_one(&mut self, reference: u32, value: f64) -> Said {
        let variable = self.variable(reference)?;
        let name = &variable.name;
        if !value.is_finite() {
            return Err(format!("{name} is {value}; it must be a finite number"));
        }
        match (variable.role, self.now.phase) {
            (Role::Time | Role::Output(_), _) => Err(format!("{name} is calculated and cannot be set")),
            (Role::Parameter(_), Phase::Runs) => {
                Err(format!("{name} is a fixed number; set it before the start"))
            }
            (_, Phase::Over) => Err(format!("the run is over; {name} can be set after a reset")),
            _ => {
                self.now.values[reference as usize] = value;
                self.now.run.take_if(|_| self.now.phase == Phase::Before);
                Ok(())
            }
        }
    }

    /// Reads variables.
    pub fn get(&mut self, references: &[u32], values: &mut [f64]) -> Said {
        same_length(references, values)?;
        for (reference, value) in references.iter().zip(values) {
            *value = match self.variable(*reference)?.role {
                Role::Time => self.now.start_s + self.now.run.as_ref().map_or(0.0, |run| run.now_s),
                Role::Output(output) => output(self.run()?.state()),
                _ => self.now.values[*reference as usize],
            };
        }
        Ok(())
    }

    /// Advances from one communication point to the next.
    pub fn step(&mut self, from_s: f64, step_s: f64) -> Said {
        let start_s = self.now.start_s;
        let (variables, values) = (&self.variables, &self.now.values);
        let (Phase::Runs, Some(run)) = (self.now.phase, &mut self.now.run) else {
            return Err("a step comes after the initialization and before the end of the run".into());
        };
        let now_s = start_s + run.now_s;
        if (from_s - now_s).abs() > SAME_TIME * now_s.abs().max(1.0) {
            return Err(format!("the step begins at {from_s} s, but the FMU is at {now_s} s"));
        }
        if !step_s.is_finite() || step_s < 0.0 {
            return Err(format!("the step is {step_s} s; it must not be negative"));
        }
        run.hold(variables::inputs_of(variables, values, run.supply_v()));
        run.go_on(from_s + step_s - start_s);
        let state = run.state();
        if ![state.reading, state.reading_integral, state.current].iter().all(|it| it.is_finite()) {
            self.now.phase = Phase::Over;
            return Err("the plant ran away to infinity; look at its numbers and inputs".into());
        }
        Ok(())
    }

    /// The plant, made anew if a number was set.
    fn run(&mut self) -> Said<&Run> {
        let made = match self.now.run.take() {
            Some(run) => run,
            None => variables::run(&self.model, &self.variables, &self.now.values)?,
        };
        Ok(self.now.run.insert(made))
    }

    fn variable(&self, reference: u32) -> Said<&Variable> {
        self.variables.get(reference as usize).ok_or_else(|| {
            format!("value reference {reference} is unknown; the last one is {}", self.variables.len() - 1)
        })
    }
}

fn same_length(references: &[u32], values: &[f64]) -> Said {
    match references.len() == values.len() {
        true => Ok(()),
        false => Err(format!("{} value references came with {} values", references.len(), values.len())),
    }
}

/// The folder behind a location of FMI 2.0, such as `file:///tmp/a%20b/resources`.
pub fn folder(location: &str) -> Said<PathBuf> {
    let Some(rest) = location.strip_prefix("file:") else {
        return Err(format!("the resources are at {location}; only file: locations can be read"));
    };
    let path =
        rest.strip_prefix("//").map_or(rest, |behind| behind.strip_prefix("localhost").unwrap_or(behind));
    let path = percent_decode_str(path).decode_utf8().map_err(|error| format!("{location}: {error}"))?;
    // A drive of Windows: /C:/…
    let drive = path.strip_prefix('/').filter(|rest| rest.as_bytes().get(1) == Some(&b':'));
    Ok(PathBuf::from(drive.unwrap_or(&path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_location_is_a_folder() {
        let folder = |location| folder(location).map(|path| path.display().to_string());
        assert_eq!(folder("file:///tmp/a%20b/resources"), Ok("/tmp/a b/resources".into()));
        assert_eq!(folder("file:/tmp/x"), Ok("/tmp/x".into()));
        assert_eq!(folder("file:///C:/x"), Ok("C:/x".into()));
        assert!(folder("http://x").is_err());
    }
}
