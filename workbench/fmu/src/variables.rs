//! What an importer sets and reads: one list from the model, for the library and for `modelDescription.xml`.

use crate::run::{Inputs, Run};
use truing_core::system::effects::{linear_key, linear_unit};
use truing_core::system::model::table::{BASE, Takes, find};
use truing_core::system::model::{Kind, Known, Model};
use truing_core::system::plant::physics::Drive;
use truing_core::system::plant::state::State;
use truing_core::text::input_error::InputError;

/// Length of a row, s, where nobody sets another one. By judgement: a usual rate of logs; inner steps are as fine as the motor asks for.
const ROW_S: f64 = 1e-3;

/// One variable; its place in the list is its value reference.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its meaning, and how sure a number is.
    pub about: String,
    /// Its unit.
    pub unit: String,
    /// What it is for.
    pub role: Role,
    /// Its value at the start; not of what is calculated.
    pub start: f64,
}

/// What a variable is for.
#[derive(Clone, Copy, Debug)]
pub enum Role {
    /// The time.
    Time,
    /// A number of the model, as long as nothing runs.
    Parameter(Number),
    /// Set at communication points.
    Input(fn(&mut Inputs) -> &mut f64),
    /// Read at communication points.
    Output(fn(&State) -> f64),
}

/// A number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// Of the base, by its key.
    Base(&'static str),
    /// Of a known effect: which one, and which of its parameters.
    Known(usize, usize),
    /// Length of a row.
    Row,
}

/// All of them, of a model whose FMU can be made.
pub fn of(model: &Model) -> Result<Vec<Variable>, InputError> {
    let time = variable("time", "s", Role::Time, 0.0, "Time");
    let mut all = vec![time];
    all.extend(inputs(model)?);
    all.extend(outputs(model));
    all.extend(numbers(model));
    Ok(all)
}

fn variable(name: &str, unit: &str, role: Role, start: f64, about: &str) -> Variable {
    Variable { name: name.into(), about: about.into(), unit: unit.into(), role, start }
}

fn inputs(model: &Model) -> Result<Vec<Variable>, InputError> {
    let plant = model.physics();
    let drive = Role::Input(|inputs| &mut inputs.drive);
    let mut all = vec![match plant.drive {
        Drive::Voltage => variable("voltage", "V", drive, 0.0, "Voltage at the terminals"),
        Drive::Torque => {
            variable("input", "", drive, 0.0, "Input of the drive; drive_gain turns it into a torque")
        }
    }];
    // A first-order model knows no torque.
    if !matches!(model.kind, Kind::FirstOrder { .. }) {
        let (name, unit) = if model.linear() { ("load_force", "N") } else { ("load_torque", "N m") };
        let load = Role::Input(|inputs| &mut inputs.load);
        all.push(variable(name, unit, load, 0.0, "From outside; positive drives the speed upwards"));
    }
    if plant.source_ohm > 0.0 && plant.drive == Drive::Voltage {
        let why = "its supply sags, but nobody knows from where; add nominal_v = … under [supply]";
        let supply = model.supply_nominal_v.ok_or_else(|| InputError::file(&model.source, why))?;
        all.push(variable(
            "supply",
            "V",
            Role::Input(|inputs| &mut inputs.supply_v),
            supply,
            "Supply without load",
        ));
    }
    Ok(all)
}

fn outputs(model: &Model) -> Vec<Variable> {
    let (speed, place, position) = match model.linear() {
        true => ("m/s", "m", "position"),
        false => ("rad/s", "rad", "angle"),
    };
    let output = |name: &str, unit, of, about| variable(name, unit, Role::Output(of), 0.0, about);
    let mut all = vec![
        output("speed", speed, |state: &State| state.reading, "Speed as the sensor reports it"),
        output(position, place, |state| state.reading_integral, "Integral of the reported speed"),
        output("shaft_speed", speed, |state| state.omega, "True speed of the motor"),
        output(&format!("shaft_{position}"), place, |state| state.theta, "True place of the motor"),
    ];
    if matches!(model.kind, Kind::DcMotor { .. }) {
        all.push(output("current", "A", |state| state.current, "Current in the winding"));
    }
    all
}

fn numbers(model: &Model) -> Vec<Variable> {
    let row = "The plant is simulated as from a log with a row at every change of an input and every row_s after it";
    let mut all = vec![variable("row_s", "s", Role::Parameter(Number::Row), ROW_S, row)];
    for (key, value) in model.parameters() {
        let row = BASE.iter().find_map(|section| find(section, key));
        let (about, unit) = row.map_or(("", ""), |row| (row.about, row.unit));
        let unit = if crate::units::exponents(unit).is_some() { unit } else { "" };
        let percent = 100.0 * model.tolerance(key);
        let about = format!("{about} ± {percent} % (1 σ)");
        all.push(variable(key, unit, Role::Parameter(Number::Base(key)), value, &about));
    }
    for (which, known) in model.known.iter().enumerate() {
        all.extend((0..known.values.len()).map(|place| known_number(model, known, which, place)));
    }
    all
}

fn known_number(model: &Model, known: &Known, which: usize, place: usize) -> Variable {
    let (effect, parameter) = (known.effect, &known.effect.parameters[place]);
    let (key, unit) = match model.linear() {
        true => (linear_key(parameter.name), linear_unit(parameter.unit)),
        false => (parameter.name.to_owned(), parameter.unit.to_owned()),
    };
    let sure = known.stds[place].map_or(String::new(), |std| format!("; ± {std} {unit} (1 σ)"));
    let origin = known.origin.as_ref().map_or(String::new(), |origin| format!("; {origin}"));
    let about = format!("{}{sure}{origin}", effect.summary);
    let role = Role::Parameter(Number::Known(which, place));
    variable(&format!("{}.{key}", effect.name), &unit, role, known.values[place], &about)
}

/// The plant with these values in the place of the model's, at rest.
pub fn run(model: &Model, variables: &[Variable], values: &[f64]) -> Result<Run, String> {
    let (mut model, mut row_s) = (model.clone(), ROW_S);
    for (variable, value) in variables.iter().zip(values) {
        if let Role::Parameter(number) = variable.role {
            refuse(variable, number, *value)?;
            match number {
                Number::Base(key) => model.set_parameter(key, *value),
                Number::Known(which, place) => model.known[which].values[place] = *value,
                Number::Row => row_s = *value,
            }
        }
    }
    let plant = model.physics();
    let inputs = inputs_of(variables, values, plant.supply_v);
    Ok(Run::new(plant, row_s, inputs))
}

/// The inputs among the values. `supply_v`: where it is none of them.
pub fn inputs_of(variables: &[Variable], values: &[f64], supply_v: f64) -> Inputs {
    let mut inputs = Inputs { drive: 0.0, load: 0.0, supply_v };
    for (variable, value) in variables.iter().zip(values) {
        if let Role::Input(place) = variable.role {
            *place(&mut inputs) = *value;
        }
    }
    inputs
}

/// A number that the model would not have taken.
fn refuse(variable: &Variable, number: Number, value: f64) -> Result<(), String> {
    let name = &variable.name;
    let takes = match number {
        Number::Base(key) => BASE.iter().find_map(|section| find(section, key)).map(|row| row.takes),
        Number::Row => Some(Takes::Positive),
        Number::Known(..) => None,
    };
    match takes {
        Some(Takes::Positive) if value <= 0.0 => Err(format!("{name} is {value}; it must be greater than 0")),
        Some(Takes::NotNegative) if value < 0.0 => Err(format!("{name} is {value}; it must not be negative")),
        _ => Ok(()),
    }
}
