//! MJCF: one joint with the motor, its friction, its loads and its encoder, for MuJoCo 4.0 or later.
//!
//! What was measured in the engine and is easily done wrong: MuJoCo's cogging drives where the plant's resists, so the phase is half a
//! turn off; friction at the default `solreffriction` and `solimpfriction` is twelve times less exact than at the ones written here.

use crate::numbers::{Of, spread, with_spread};
use crate::plan::{Actuator, Plan, touches};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write;
use truing_core::system::model::Model;
use truing_core::system::plant::laws::{Acts, Law, TorqueLaw};
use truing_core::system::plant::physics::{Drive, Physics};

/// MuJoCo asks for some mass and inertia of a body; of the rotor the rest is armature. A part of the motor's.
const LEAST: f64 = 1e-6;

/// The file. `head`: lines of its first comment.
pub fn written(model: &Model, head: &[String]) -> String {
    let plant = model.physics();
    let file = File { model, p: &plant, plan: Plan::of(&plant) };
    let mut text = format!("<!--\n  {}\n", head.join("\n  ").replace("--", "– –"));
    if file.plan.helper() {
        text += "  The helper beside this file does what MJCF has no words for: call install(model) before the first step.\n";
    }
    let _ = writeln!(text, "  For MuJoCo 4.0 or later. Larger steps than the one below cost accuracy.\n-->");
    text += "<mujoco model=\"servo\">\n";
    let _ = writeln!(text, "  <option timestep=\"{}\" integrator=\"implicitfast\"/>", file.plan.step_s);
    text += &file.body();
    text += &file.tendons();
    text += &file.actuators();
    text += &file.sensors();
    text + "</mujoco>\n"
}

struct File<'a> {
    model: &'a Model,
    p: &'a Physics,
    plan: Plan,
}

/// The mean of both directions: what differs is a constant torque, also while the axis sticks.
fn level(p: &Physics) -> f64 {
    (p.friction_pos + p.friction_neg) / 2.0
}

impl File<'_> {
    fn with(&self, of: Of) -> String {
        let (value, std) = spread(self.model, of);
        with_spread(value, Some(std))
    }

    fn kind(&self) -> &'static str {
        if self.model.linear() { "slide" } else { "hinge" }
    }

    /// Gravity pulls along z: it neither turns a shaft about it nor moves what slides across it.
    fn axis(&self) -> &'static str {
        if self.model.linear() { "1 0 0" } else { "0 0 1" }
    }

    fn body(&self) -> String {
        let p = self.p;
        let motor = p.inertia * if self.plan.two_bodies { 1.0 - p.load_share } else { 1.0 };
        let mut joint = format!("armature=\"{motor}\" damping=\"{}\"", self.damping());
        let _ = write!(joint, " {}", self.friction());
        if !self.plan.two_bodies
            && let Some(spring) = self.spring()
        {
            let [k, rest, cubic] = spring.parameters;
            let _ = write!(joint, " stiffness=\"{k} 0 {cubic}\" springref=\"{rest}\"");
        }
        let inertial = |inertia: f64| {
            format!(
                "<inertial pos=\"0 0 0\" mass=\"{inertia}\" diaginertia=\"{inertia} {inertia} {inertia}\"/>"
            )
        };
        let mut text = format!(
            "  <!-- armature {} kg m²; damping {} N m s/rad; frictionloss {} N m -->\n",
            self.with(|p| p.inertia),
            self.with(|p| p.viscous),
            self.with(level)
        );
        // Angles are radians: the rest of a spring and the range of a play.
        text = format!("  <compiler angle=\"radian\"/>\n{text}  <worldbody>\n    <body name=\"rotor\">\n");
        let _ = writeln!(
            text,
            "      <joint name=\"shaft\" type=\"{}\" axis=\"{}\" {joint}/>\n      {}",
            self.kind(),
            self.axis(),
            inertial(p.inertia * LEAST)
        );
        text +=
            "      <geom type=\"cylinder\" size=\"0.02 0.01\" contype=\"0\" conaffinity=\"0\" mass=\"0\"/>\n";
        text += "      <geom type=\"box\" pos=\"0.03 0 0.012\" size=\"0.03 0.004 0.003\" contype=\"0\" conaffinity=\"0\" mass=\"0\" rgba=\"0.85 0.3 0.2 1\"/>\n";
        if self.plan.two_bodies {
            let _ = writeln!(
                text,
                "      <body name=\"load\" pos=\"0 0 0.03\">\n        <joint name=\"twist\" type=\"{}\" axis=\"{}\" {}/>\n        {}\n      </body>",
                self.kind(),
                self.axis(),
                self.coupling(),
                inertial(p.inertia * p.load_share)
            );
        }
        text + "    </body>\n  </worldbody>\n"
    }

    /// Linear and quadratic.
    fn damping(&self) -> String {
        let laws = self.p.torques.iter();
        let drag: f64 = laws.filter(|law| law.law == Law::Drag).map(|law| law.parameters[0]).sum();
        let even = if self.p.viscous_pos == self.p.viscous_neg { self.p.viscous_pos } else { 0.0 };
        format!("{} {drag} 0", self.p.viscous + even)
    }

    /// Friction that takes away the speed of one step and no more, as that of the plant: a time constant of two steps is the shortest that
    /// MuJoCo takes, and the largest impedance is the least creep.
    fn friction(&self) -> String {
        let level = level(self.p);
        if level <= 0.0 && !self.plan.friction {
            return String::new();
        }
        let tight = "solimpfriction=\"0.9999 0.9999 0.001 0.5 2\"";
        // A level of nothing would leave the helper without a constraint to set.
        format!(
            "frictionloss=\"{}\" {tight} solreffriction=\"{} 1\"",
            level.max(1e-12),
            2.0 * self.plan.step_s
        )
    }

    fn spring(&self) -> Option<&TorqueLaw> {
        self.p.torques.iter().find(|law| law.law == Law::Spring)
    }

    /// What joins motor and load.
    fn coupling(&self) -> String {
        let p = self.p;
        if p.stiffness.is_finite() {
            return format!("stiffness=\"{}\" damping=\"{}\"", p.stiffness, p.coupling_damping);
        }
        if touches(p) {
            return String::new();
        }
        let half = p.gap_rad / 2.0;
        let hard = "solimplimit=\"0.9999 0.9999 0.001 0.5 2\"";
        format!(
            "limited=\"true\" range=\"{} {half}\" {hard} solreflimit=\"{} 1\"",
            -half,
            2.0 * self.plan.step_s
        )
    }

    /// Angle of the load, and a reading of another scale.
    fn tendons(&self) -> String {
        let p = self.p;
        let mut text = String::new();
        let mut fixed = |name: &str, more: &str, motor: f64, twist: f64| {
            let _ =
                write!(text, "    <fixed name=\"{name}\" {more}><joint joint=\"shaft\" coef=\"{motor}\"/>");
            if twist != 0.0 {
                let _ = write!(text, "<joint joint=\"twist\" coef=\"{twist}\"/>");
            }
            text += "</fixed>\n";
        };
        if self.plan.two_bodies {
            let spring = self.spring().map_or(String::new(), |law| {
                let [k, rest, cubic] = law.parameters;
                format!("stiffness=\"{k} 0 {cubic}\" springlength=\"{rest}\"")
            });
            fixed("load_angle", &spring, 1.0, 1.0);
        }
        let behind = if self.plan.two_bodies && p.encoder_at_load { p.sensor_scale } else { 0.0 };
        fixed("encoder", "", p.sensor_scale, behind);
        format!("  <tendon>\n{text}  </tendon>\n")
    }

    fn actuators(&self) -> String {
        let p = self.p;
        let per_volt = self.with(|p| p.torque_per_input() * p.drive_gain);
        let mut text = format!("  <!-- torque per input at rest {per_volt} N m -->\n  <actuator>\n");
        let _ = writeln!(text, "    {}", self.motor());
        for (number, law) in p.torques.iter().enumerate() {
            let Some((amplitude, periods, phase)) = sine(law, p) else { continue };
            let on = match (law.acts, self.plan.two_bodies) {
                (Acts::Load, true) => "tendon=\"load_angle\"",
                _ => "joint=\"shaft\"",
            };
            let _ =
                writeln!(text, "    {}", passive(&format!("load_{number}"), on, amplitude, periods, phase));
        }
        let uneven = (p.friction_neg - p.friction_pos) / 2.0;
        if uneven != 0.0 {
            let _ = writeln!(
                text,
                "    {}",
                passive("friction_difference", "joint=\"shaft\"", uneven, 0.0, FRAC_PI_2)
            );
        }
        text + "  </actuator>\n"
    }

    /// The drive.
    fn motor(&self) -> String {
        let p = self.p;
        let mut range = String::new();
        if self.plan.actuator != Actuator::Helper {
            if p.limit.is_finite() {
                let bound = |limit: f64| (limit - p.drive_offset) / p.drive_gain;
                let _ = write!(range, " ctrlrange=\"{} {}\"", bound(-p.limit * p.limit_skew), bound(p.limit));
            }
            if p.delay_s > 0.0 {
                // Room for steps half as long.
                let samples = (2.0 * p.delay_s / self.plan.step_s).ceil() as usize + 2;
                let _ = write!(range, " delay=\"{}\" nsample=\"{samples}\" interp=\"linear\"", p.delay_s);
            }
        }
        match self.plan.actuator {
            Actuator::Helper => {
                "<general name=\"motor\" joint=\"shaft\" gaintype=\"fixed\" gainprm=\"0\" biastype=\"user\"/>"
                    .into()
            }
            Actuator::General => self.general(&range),
            Actuator::DcMotor => self.dcmotor(&range),
        }
    }

    fn general(&self, range: &str) -> String {
        let p = self.p;
        let (gain, emf, kt) = match p.drive {
            Drive::Voltage => (p.kt / p.resistance, p.kt * p.ke / p.resistance, p.kt),
            Drive::Torque => (p.force_gain, 0.0, p.force_gain),
        };
        let mut more = String::new();
        if p.lag_s > 0.0 {
            let _ = write!(more, " dyntype=\"filterexact\" dynprm=\"{}\"", p.lag_s);
        }
        if p.current_limit.is_finite() {
            let _ = write!(more, " forcerange=\"{0} {1}\"", -p.current_limit * kt, p.current_limit * kt);
        }
        format!(
            "<general name=\"motor\" joint=\"shaft\" gainprm=\"{}\" biastype=\"affine\" biasprm=\"{} 0 {}\"{range}{more}/>",
            gain * p.drive_gain,
            gain * p.drive_offset,
            -emf
        )
    }

    /// `dcmotor` has one constant and no gain of the drive: another unit of the current makes room for both.
    fn dcmotor(&self, range: &str) -> String {
        let p = self.p;
        let constant = p.ke / p.drive_gain;
        let unit = p.kt / constant;
        let resistance = p.resistance / (p.drive_gain * unit);
        let mut more = String::new();
        if p.inductance > 0.0 {
            let _ = write!(more, " inductance=\"{} 0\"", p.inductance / (p.drive_gain * unit));
        }
        if p.heat_rise_per_w > 0.0 {
            let rise = p.heat_rise_per_w * p.ke / p.kt;
            let _ = write!(more, " thermal=\"1 0 {} {rise} 25 25\"", p.heat_time_s);
        }
        format!(
            "<dcmotor name=\"motor\" joint=\"shaft\" resistance=\"{resistance}\" motorconst=\"{constant} {constant}\"{range}{more}/>"
        )
    }

    fn sensors(&self) -> String {
        let limit = self.p.sensor_limit;
        let cutoff = if limit.is_finite() { format!(" cutoff=\"{limit}\"") } else { String::new() };
        format!(
            "  <sensor>\n    <tendonpos name=\"angle\" tendon=\"encoder\"/>\n    <tendonvel name=\"speed\" tendon=\"encoder\"{cutoff}/>\n  </sensor>\n"
        )
    }
}

/// Amplitude, periods to a radian and phase of a torque +A·sin(n·θ + φ).
fn sine(law: &TorqueLaw, p: &Physics) -> Option<(f64, f64, f64)> {
    let [a, b, c] = law.parameters;
    match law.law {
        Law::Constant => Some((a, 0.0, FRAC_PI_2)),
        Law::Gravity => Some((a / p.gear_ratio, 1.0 / p.gear_ratio, b + PI)),
        Law::Cogging => Some((a, b, c + PI)),
        Law::Wave => Some((a, b, c)),
        Law::Periodic | Law::Spring | Law::Drag => None,
    }
}

/// A torque of the place alone: the cogging of a motor without a winding.
fn passive(name: &str, on: &str, amplitude: f64, periods: f64, phase: f64) -> String {
    format!(
        "<dcmotor name=\"{name}\" {on} input=\"none\" motorconst=\"0 0\" resistance=\"1\" cogging=\"{amplitude} {periods} {phase}\"/>"
    )
}
